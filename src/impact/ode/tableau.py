"""The Dormand-Prince 5(4) pair, in exact fractions.

Dormand JR, Prince PJ (1980) A family of embedded Runge-Kutta formulae. J. Comput. Appl. Math. 6, 19. The
interpolant of order four is that of Shampine LF (1986) Some practical Runge-Kutta formulas. Math. Comp. 46, 135.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np


def _row(*texts: str) -> tuple[Fraction, ...]:
    return tuple(Fraction(text) for text in texts)


# stage j is evaluated at y + h Σ A[j][i] k[i]; the last row is the solution of order five,
# so that the last stage of a step is the first of the next
A = (
    _row(),
    _row("1/5"),
    _row("3/40", "9/40"),
    _row("44/45", "-56/15", "32/9"),
    _row("19372/6561", "-25360/2187", "64448/6561", "-212/729"),
    _row("9017/3168", "-355/33", "46732/5247", "49/176", "-5103/18656"),
    _row("35/384", "0", "500/1113", "125/192", "-2187/6784", "11/84"),
)
C = _row("0", "1/5", "3/10", "4/5", "8/9", "1", "1")

# the solution of order five, and the difference to the embedded one of order four
B = (*A[6], Fraction(0))
E = _row("71/57600", "0", "-71/16695", "71/1920", "-17253/339200", "22/525", "-1/40")

# the interpolant: y(θ) = y + h Σᵢ k[i] Σⱼ P[i][j] θ^(j+1)
P = (
    _row("1", "-8048581381/2820520608", "8663915743/2820520608", "-12715105075/11282082432"),
    _row("0", "0", "0", "0"),
    _row("0", "131558114200/32700410799", "-68118460800/10900136933", "87487479700/32700410799"),
    _row("0", "-1754552775/470086768", "14199869525/1410260304", "-10690763975/1880347072"),
    _row("0", "127303824393/49829197408", "-318862633887/49829197408", "701980252875/199316789632"),
    _row("0", "-282668133/205662961", "2019193451/616988883", "-1453857185/822651844"),
    _row("0", "40617522/29380423", "-110615467/29380423", "69997945/29380423"),
)

DENSE_WEIGHTS = np.array([[float(p) for p in row] for row in P])
