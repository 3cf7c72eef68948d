"""Rigid balls with Coulomb's friction, as an adapter: impact conform --adapter rigid.py:collide"""


def collide(c: dict) -> dict:
    wall = c["m2"] is None
    # the inverse masses along n and t, of each ball
    n1, n2 = 1 / c["m1"], 0.0 if wall else 1 / c["m2"]
    t1 = n1 + c["R1"] ** 2 / c["inertia1"]
    t2 = 0.0 if wall else n2 + c["R2"] ** 2 / c["inertia2"]
    R2 = 0.0 if wall else c["R2"]

    closing_speed = c["v1"] - c["v2"]
    slip = (c["u1"] + c["R1"] * c["omega1"]) - (c["u2"] - R2 * c["omega2"])
    normal = (1 + c["e"]) * max(closing_speed, 0.0) / (n1 + n2)
    limit = c["mu"] * normal
    friction = max(-limit, min(slip / (t1 + t2), limit))

    answer = {
        "id": c["id"],
        "v1": c["v1"] - n1 * normal,
        "u1": c["u1"] - n1 * friction,
        "omega1": c["omega1"] - c["R1"] * friction / c["inertia1"],
    }
    if not wall:
        answer["v2"] = c["v2"] + n2 * normal
        answer["u2"] = c["u2"] + n2 * friction
        answer["omega2"] = c["omega2"] - R2 * friction / c["inertia2"]
    return answer
