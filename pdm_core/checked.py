"""What users hand over, checked on entry: numbers, colours, points, indices; anything else is a SceneError."""

import math

import numpy as np

NAMED = 3  # in a sentence
LEAST, MOST = 1e-30, 1e30  # magnitudes that single precision still holds with room for products


class SceneError(ValueError):
    """Invalid input; the message names the surface and says what to do."""


def within(values):
    """Whether all numbers of an array are finite, and small enough for products of them to be so."""
    return bool((np.abs(values) <= MOST).all())


def of_kind(value, kind, what):
    """SceneError where what was handed to a function is not of the kind that it needs."""
    if not isinstance(value, kind):
        raise SceneError(f"{what} needs a {kind.__name__}, not {value!r}")


def as_array(value, what):
    """Whatever was given, as an array."""
    try:
        return np.asarray(value)
    except (TypeError, ValueError) as error:
        raise SceneError(f"{what} must be numbers, not {value!r}") from error


def array(value, what):
    """Real numbers of any shape as a float64 array."""
    out = as_array(value, what)
    if out.dtype.kind not in "iuf" and not (out.size == 0 and out.dtype.kind != "O"):
        raise SceneError(f"{what} must be real numbers, not {value!r}")
    return out.astype(np.float64)


def vector(value, shape, what):
    """Real numbers of that shape, read-only."""
    out = array(value, what)
    if out.shape != shape:
        raise SceneError(f"{what} must have shape {shape}, not {out.shape}")
    out.flags.writeable = False
    return out


def finite(value, shape, what):
    """The same, none of them infinite or nan."""
    out = vector(value, shape, what)
    if not within(out):
        raise SceneError(f"{what} is {out.tolist()}; use finite numbers up to {MOST:g}")
    return out


def direction_of(value, what):
    """(3,) of length 1."""
    given = vector(value, (3,), what)
    most = np.abs(given).max()
    if not 0 < most < np.inf:
        raise SceneError(f"{what} is {given.tolist()}; use a finite vector of some length")
    return given / most / np.linalg.norm(given / most, axis=-1)


def number(value, what, advice, above=-np.inf, below=np.inf):
    """A float strictly between two bounds."""
    out = array(value, what)
    if out.shape != () or not above < float(out) < below:
        raise SceneError(f"{what} is {value!r}; use {advice}")
    return float(out)


def function(value, what, advice):
    """What is to be called."""
    if not callable(value):
        raise SceneError(f"{what} is {value!r}; give a function {advice}")
    return value


def target_of(value):
    """A target error."""
    return number(value, "target_error", "a number above 0 such as 0.01", LEAST, MOST)


def colour(value, what):
    """(3,) finite and at least 0; one number stands for three equal channels."""
    out = array(value, what)
    out = np.repeat(out, 3) if out.shape == () else out
    if out.shape != (3,):
        raise SceneError(f"{what} must be 1 or 3 numbers, not of shape {out.shape}")
    parts = out.tolist()  # of three numbers plain Python knows sooner
    if not all(0 <= part < math.inf for part in parts):
        raise SceneError(f"{what} is {out.tolist()}; use finite numbers of at least 0")
    if any(part > 0 and not LEAST <= part <= MOST for part in parts):
        raise SceneError(f"{what} is {out.tolist()}; use 0 or numbers from {LEAST:g} to {MOST:g}")
    out.flags.writeable = False
    return out


def yes_or_no(value, what):
    """A bool."""
    if not isinstance(value, bool | np.bool_ | int | np.integer):
        raise SceneError(f"{what} is {value!r}; use True or False")
    return bool(value)


def told_by(function, places, what):
    """What a function tells of places or directions (n, 3), finite -> (n, 3)"""
    out = array(function(places), what)
    if out.shape != places.shape:
        raise SceneError(f"{what} must give numbers of shape {places.shape} there, not {out.shape}")
    if not np.isfinite(out).all():
        raise SceneError(f"{what} is not finite everywhere; mend its NaN and infinite values, as in pictures")
    return out


def vectors(value, what):
    """(n, 3) finite; one of shape (3,) counts as one row."""
    out = array(value, what)
    out = out[None] if out.shape == (3,) else out.reshape(0, 3) if out.size == 0 else out
    if out.ndim != 2 or out.shape[1] != 3:
        raise SceneError(f"{what} must have shape (n, 3), not {out.shape}")
    if not within(out):
        raise SceneError(f"{what} are not all finite numbers up to {MOST:g}; leave out the others")
    return out


def told_or_nan(value, shape, what):
    """What may be told of points, numbers of that shape, nan where it is not, or None."""
    out = None if value is None else vector(value, shape, what)
    if out is not None and not within(np.nan_to_num(out, posinf=np.inf, neginf=-np.inf)):
        raise SceneError(f"{what} hold infinite numbers; use nan, or None for all, where nothing is told")
    return out


def index(value, count, what):
    """An index from 0 to count - 1."""
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | np.integer) or not 0 <= value < count:
        raise SceneError(f"{what} is {value!r}; use an index from 0 to {count - 1}")
    return int(value)


def indices(value, count, length, what):
    """(length,) indices from 0 to count - 1: one for all, or as many."""
    if not isinstance(value, list | tuple) and getattr(value, "ndim", 0) != 1:
        return np.full(length, index(value, count, what))
    given = array(value, what)
    whole = np.asarray(value).dtype.kind in "iu" or not given.size
    if given.shape != (length,) or not whole or not ((given >= 0) & (given < count)).all():
        raise SceneError(f"{what} must be {length} indices from 0 to {count - 1}, or one for all points")
    return given.astype(int)


def some_of(names, count=None):
    """The first NAMED of names, and how many more there are, of so many, if not of these."""
    more = (len(names) if count is None else count) - NAMED
    return ", ".join(names[:NAMED]) + (f" and {more} more" if more > 0 else "")
