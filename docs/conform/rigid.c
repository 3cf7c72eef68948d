/* Rigid balls with Coulomb's friction: cc -o rigid rigid.c -lm; impact conform --adapter ./rigid */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static double get(const char *line, const char *key) { /* null is 0 */
    const char *at = strstr(line, key);
    return at ? strtod(at + strlen(key), NULL) : NAN;
}

int main(void) {
    char line[4096], id[64];
    while (fgets(line, sizeof line, stdin) && sscanf(line, "{\"id\": \"%63[^\"]", id) == 1) {
        double m1 = get(line, "\"m1\":"), R1 = get(line, "\"R1\":"), I1 = get(line, "\"inertia1\":");
        double m2 = get(line, "\"m2\":"), R2 = get(line, "\"R2\":"), I2 = get(line, "\"inertia2\":");
        double v1 = get(line, "\"v1\":"), u1 = get(line, "\"u1\":"), w1 = get(line, "\"omega1\":");
        double v2 = get(line, "\"v2\":"), u2 = get(line, "\"u2\":"), w2 = get(line, "\"omega2\":");
        double n2 = m2 ? 1 / m2 : 0, t2 = m2 ? n2 + R2 * R2 / I2 : 0; /* of a wall 0 */
        double N = (1 + get(line, "\"e\":")) * fmax(v1 - v2, 0) / (1 / m1 + n2), F = get(line, "\"mu\":") * N;
        double P = (u1 + R1 * w1 - u2 + R2 * w2) / (1 / m1 + R1 * R1 / I1 + t2);
        P = fmax(-F, fmin(P, F));
        printf("{\"id\": \"%s\", \"v1\": %.17g, \"v2\": %.17g, ", id, v1 - N / m1, v2 + N * n2);
        printf("\"u1\": %.17g, \"u2\": %.17g, ", u1 - P / m1, u2 + P * n2);
        printf("\"omega1\": %.17g, \"omega2\": %.17g}\n", w1 - R1 * P / I1, m2 ? w2 - R2 * P / I2 : 0);
        fflush(stdout);
    }
}
