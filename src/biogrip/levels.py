"""Every level and threshold that decides what a user is told of a trace, with its reason.

Levels of significance say how often a right fit is blamed by chance; `docs/levels.md` has how often
all tests together do. What has no such reason is chosen, and said to be. Tolerances of numerical
methods stand beside the loops that they end.
"""

# What a fit leaves.

FALSE_ALARM = 0.003
"""Level of each test that makes a fit doubtful: with some five tests, few in a hundred right ones
are."""

CERTAIN_MISFIT = 0.001
"""Level of the test that tells misfit from noise, stricter as it may reject a fit."""

OUTLYING = 4.5
"""Distance of an outlier from the median of the residuals around, in standard deviations of the
noise: one Gaussian reading in 150,000 is further away."""

TOO_MUCH = 1.2
"""Misfit over the scatter of neighbouring readings from which on it changes limits. Chosen: by less
it would widen them by a fifth at most."""

FAR_OFF = 0.02
"""Share of the peak from which on a certain misfit rejects a fit. Chosen: up to there limits allow
for a misfit, which `tests/judging/test_whiteness.py` simulates."""

NOISE_FREE, NOISE_FREE_OF_PEAK, NO_SCATTER, UNRESOLVED = 0.01, 1e-3, 0.1, 1e-6
"""A misfit below these shares of the noise and of the peak is that of a trace without noise, if
neighbours scatter by this share of it; and so is one below what no sensor resolves."""

TOO_LITTLE = 0.5
"""Misfit over a given noise below which that is doubted. Chosen: noise is rarely known better."""

CLEARLY = 3.0
"""Growth of noise from which on its share is known, and unweighted fits are not compared; misfit
over the noise that is told first, whatever explains it."""

FEWEST_STEPS = 6
"""Extent of a record in steps of its rounding from which it may be a smooth course in coarse steps;
a load that is on or off, or a staircase of a few levels, has steps that happened."""

REPEATED, ALIKE, ONE_STEP = 0.45, 12.0, 1.5
"""Share of readings that repeat the one before if a sensor is logged more often than it is read:
half or more if it is logged twice as often; how many times the usual run the longest may be, as if
it is read at random; and the change after a run, in steps of rounding, which repeats alone."""

# Slow noise, which may be misfit.

MOSTLY, SLOW, NOTICEABLE, LONG = 0.5, 0.02, 1 / 3, 0.2
"""Correlated noise may be misfit if it has most of the variance and lasts for more than a fiftieth
of the trace, or a noticeable share and a fifth: a trace then has fewer than five independent parts.
Chosen."""

SURE = 2.0
"""Standard deviations by which estimates of slow noise count less: one in forty is lower still."""

SMOOTH = 3.0
"""Scatter over that of noise which is correlated for `SLOW` from which on it is no such noise.
Chosen."""

IN_ONE_STRETCH = 0.3
"""Share of the sum of squares that none of 20 stretches has of stationary noise which is correlated
for less than half a stretch: what has it is no such noise."""

TOLD = 0.03
"""Least share of a reading's variance, or of a step's squares, that a fit leaves where it is told:
a fit that absorbs more follows the reading. Chosen."""

TWO_MORE = 4.0
"""Decrease of the deviance by which a misfit is no white noise: AIC's price of its two numbers."""

FEWEST_INDEPENDENT, LEAST_FREEDOM = 0.3, 3.0
"""A misfit that is smooth over half a trace would seem worth next to nothing: so few hardly lower
the share of limits that hold (`tests/judging/test_whiteness.py`)."""

# The start of a protocol.

SURELY = 1e-9
"""Level of the tests for a late start and a tare, so that correlated noise does not look like
one."""

CONSTANT, CONSTANT_OF_PEAK, FEWEST_BEFORE = 2.0, 1e-3, 3
"""Standard deviation of constant readings, in noise and in peaks of noise-free traces, and fewest
of which it is known. Chosen."""

OFFSET = 40.0
"""Fall of chi^2 by which an offset is better than a late start: by chance once in a billion."""

DELAYED, FEWEST_APART, PLANNED = 10.0, 3, (0.5, 1.5)
"""First intervals from a change to the first reading of a trace that is cut off, fewest readings by
which their growth is known, and its powers of the time if someone spaced them. Chosen."""

HELD = 0.1
"""Change of a recorded load, as a share of it, that is held. Chosen."""

SAME_SHARE = 0.02
"""Difference of standard deviations, over the readings, that may be rounding. Chosen."""

NO_LOAD = 0.01
"""Share of the largest load up to which rows tell the zero: they show hardly more of it. Chosen."""

FEWEST_STILL = 8
"""Rows of a record from which on a trend is told: of fewer, an arc at a sine's crest is none."""

WHITE = 1.5
"""Misfit over the scatter of neighbours that a right fit does not exceed. Chosen, above `TOO_MUCH`:
it accuses a clock."""

KNOWN_START = 0.1
"""Share of the time between readings to which a fitted start must be known to tell a ring. Chosen:
a ring lasts for less than an interval."""

# Limits and verdicts.

CERTAIN = 0.999
"""Confidence that a profile must reach at an end of the range to have a limit on that side: that
the range ends there is chosen, and must not decide."""

MISSED = 0.05
"""Increase of chi^2, from the weak prior of local fits, beyond which a fit is not the optimum: an
eightieth of what moves a 95 % limit."""

EXACT = 1e-7
"""Misfit over the peak below which a fit is not lowered: no instrument reads 24 bits."""

WIDE = 3.0
"""Limits further than this factor from their middle tell little more than an order of magnitude:
moduli of cells of one kind scatter by a factor of about 2 to 3."""

GAP = 1.01
"""Factor by which a profile exceeds the threshold in a gap: fits give chi^2 to about 0.01."""

WORTH_A_PROFILE = 0.5
"""First-order standard deviation of the logarithm of a combination of undetermined parameters below
which it may be determined: its limits are then within a factor of e or so."""

DETERMINED_PERCENT = 100.0
"""Bound in percent from which on a quantity does not count as determined."""

BEYOND_THE_RANGE = 9.0
"""Decrease of chi^2 beyond an end of the search range that is more than chance: three standard
deviations squared."""

LITTLE = 0.01
"""Share of a value, without a model, below which a lower limit says no more than that it is
positive. Chosen."""

HANGS = 10.0
"""A limit without a model hangs on what hardly shows, and is not said, if a noise of that changes
the quantity so many times more than what shows does. Chosen."""

OF_THE_FASTEST = 1e4
"""Ratio beyond which an upper limit hangs on the fastest lag that is tried, and is not said."""

WORTH_SAYING = 0.005
"""Share of the noise's variance that is said: half of the percent that it is rounded to."""

# Several traces of one sample.

ONE_SAMPLE = 0.01
"""Level at which traces are not of one sample, for both tests together: it rejects a joint fit, of
which one in a hundred right ones is lost; each trace's own result stays."""

TELLS = 0.1
"""Information on a combination of log-parameters, in squares of e-folds, from which on a fit adapts
it, and it counts as a degree of freedom: standard deviations of three e-folds. Chosen."""

# Other models, and instruments.

WORTH_A_MENTION, STRONG = 2.0, 6.0
"""Differences of BIC from which on a simpler model is preferred, and any other (Kass and Raftery
1995)."""

FAR_BETTER = 10.0
"""Difference of BIC by which a model is far better than another (Kass and Raftery 1995)."""

VISIBLE = 0.2
"""Norm of a ring in standard deviations of the noise from which it counts as visible: no estimate
is off by more of its own, and a 95 % interval holds the truth in 94.5 % of traces."""

SMOOTHED = 1.0
"""Fall of chi^2 by which a recorded load fits better without its sensor's noise: by less than a
tenth it falls where nothing is smoothed out, and if it hardly falls, both courses will do."""

SATURATED, MORE_OFTEN, FEWEST_VALUES = 0.05, 5, 5
"""Share of readings at an end of their scale from which on they are saturated, how many times as
often as each of the next values, and fewest values."""

# Impossible traces, which are refused.

SMALLEST_SHARE, LARGEST_SHARE = 2e-3, 1.5
"""Plausible rotations over that of the free arm, which no sample exceeds but for errors of fit and
stiffness; the paper's stiffest sample turns it by 8e-3. The ratio is below 1000, so that no
trace passes both in its unit and in one a thousand times larger or smaller."""

NO_READING = 100.0
"""Distance from the median, over that of all but a tenth, of what is no reading. Chosen."""

SHORTEST_SHARE = 0.02
"""Share of the protocol that a trace must cover: more than min/h = s/min = 1/60."""

NO_RESPONSE = 1e-3
"""Share of traces of pure noise that are accepted as a response."""

BELOW_ZERO = 1e-6
"""Level, for each modulus of a sweep, at which one below zero is no noise: hardly one of 10,000
right sweeps is refused."""

FAR_ABOVE = 10.0
"""Multiple of a given noise from which a rotation is seen, however small it is."""

# Rows of several conditions, and the noise of a sweep.

CONDITIONS = 1e-3
"""Level at which readings of equal times or frequencies are no repeats: of a thousand files with
repeats one is taken for several conditions."""

MEASURED_ALIKE, APART = 0.01, 3.0
"""Share by which numbers of one condition may differ, as 19.9 and 20, and the gap between
conditions over the widest of one from which on measured numbers are of several. Chosen."""

LIKELIER = 6.0
"""Deviance by which shares of each modulus are clearly likelier than an amplitude and a phase: by
chance once in a hundred sweeps with the noise of these."""

OF_PEAK_AT_REST = 0.02
"""Load or reading of the first row, as a share of all, up to which it was at rest."""

WIDER_WITHOUT_REST = 5.0
"""Width of limits with any memory of before, over that from rest, from which on they hang on it."""
