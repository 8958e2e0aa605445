"""Under what limits of the step hold: without contacts, without joints that nothing holds, with soft constraints."""

from collections.abc import Iterator, Sequence

from .predicted import Predicted
from .sentences import in_seconds, some_of

SOFTER = 0.01  # of a limit: what soft constraints change is said from there


def circumstances(found: Sequence[Predicted]) -> str:
    """Without what the limits are: contacts, if the file has any, and joints that nothing holds; a comma or a space before."""
    robot, known_ones = found[0].at.robot, [one for one in found if one.is_known]
    texts = []
    if any(feature.feature == "contact" for feature in robot.features):
        texts.append("in the air, without contacts" if found[0].at.base else "without contacts")
    aside = dict.fromkeys(robot.coordinates.speeds[k] for one in known_ones for k in one.at.aside)
    if aside:
        texts.append(f"without {some_of(list(aside))}, which nothing holds")
    return "".join(f", {text}" for text in texts) + "," * bool(aside)


def constraints_in_words(found: Sequence[Predicted]) -> Iterator[str]:
    """What holds joints together, what rigid constraints would change, and at or beyond which of its limits it rests."""
    if any(one.at.small(base).is_coupled for one in found if one.rests for base in one.at.bases):
        yield "Equalities of the file, and limits at which a joint rests, are on here, as the soft constraints that MuJoCo has."
    for one in found:
        of_limits = one.at.beyond(0.0) if one.rests and one.at.limits else ()
        if of_limits:
            yield f"{one.name} rests at the limits of {some_of(of_limits)}."
        elif one.rests and one.at.beyond():
            yield f"{one.name} rests beyond the range of {some_of(one.at.beyond())}: the limits of joints are off here."
        softer = []
        for (base, integrator), limit in one.limits.items():
            small = one.there[base, integrator].small(base)
            rigid = (
                small.rigid.limit(integrator).dt if small.is_coupled and limit.dt and base == one.at.bases[0] else None
            )
            if rigid and abs(limit.dt / rigid - 1.0) > SOFTER:
                softer.append(f"{integrator} {in_seconds(rigid)} and not {in_seconds(limit.dt, rigid)}")
        if softer:
            yield f"Rigid constraints would have other limits at {one.name}: {'; '.join(softer)}."
        away = [name for base, name in one.pairs if base == one.at.bases[0] and one.gives_way(base, name)]
        if away:
            yield (
                f"At {one.name} a step as long as the limit of {some_of(away)} softens the constraints so far that they give way "
                "by more than 0.01 rad or m: that limit was not looked for in runs."
            )
