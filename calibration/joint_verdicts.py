"""What stage `joints` says of the models it fitted."""

from collections.abc import Iterator, Sequence

from calibration.block_covariance import ENOUGH
from calibration.joint_model import JointModel
from calibration.joint_projection import RHO, limit_of
from calibration.verdict import Verdict

STAGE = "joints"


def verdicts(
    models: Sequence[JointModel],
    worse: Sequence[str],
    unexcited: Sequence[str],
    quiet: Sequence[str],
    without: Sequence[str],
) -> Iterator[Verdict]:
    """What was fitted, and what not and why.

    Args:
        models: Of every joint with a link encoder.
        worse: Joints whose model would lead the hand away from its markers.
        unexcited: Joints whose trials fix the coefficients of no degree.
        quiet: Joints whose encoders differ by no more than noise.
        without: Joints without a link encoder.
    """
    if without:
        yield Verdict(STAGE, "missing", f"no joint model without a link encoder: {', '.join(without)}")
    used = [m for m in models if m.degree is not None]
    if used:
        yield Verdict(STAGE, "ok", f"{used[0].terms} terms; {'; '.join(_told(m) for m in used)}")
        yield from _at_limits(used)
        yield from _few_blocks(used)
    if worse:
        yield Verdict(STAGE, "ok", f"not corrected, since the hand comes no nearer to its markers: {', '.join(worse)}")
    if unexcited:
        message = f"no two trials excite {', '.join(unexcited)}: record some that move them both ways under load"
        yield Verdict(STAGE, "missing", message)
    if quiet:
        yield Verdict(STAGE, "ok", f"not corrected, since both encoders agree within their noise: {', '.join(quiet)}")
    none = [m.joint for m in models if m.degree is None and m.joint not in (*worse, *unexcited, *quiet)]
    if none:
        yield Verdict(STAGE, "ok", f"not corrected, since no degree predicts a trial left out: {', '.join(none)}")
    for model in used:
        if model.dropped:
            names = ", ".join(f"A_{i}{j}, B_{i}{j}" for i, j in model.dropped)
            yield Verdict(STAGE, "ok", f"{model.joint}: terms that are zero throughout are left out: {names}")


def _at_limits(used: Sequence[JointModel]) -> Iterator[Verdict]:
    """What a search for rho that ended at a limit leaves open."""
    for limit, rho, meaning in (
        ("lowest", RHO[0], "the direction of motion hardly chooses a flank; no coefficient is identifiable"),
        ("highest", RHO[1], "the flanks change faster than the readings show; rho is not identifiable, they are"),
    ):
        found = [m.joint for m in used if limit_of(m.rho) == limit]
        if found:
            yield Verdict(
                STAGE, "warning", f"rho at its {limit} limit, {rho:g} s/rad, in {', '.join(found)}: {meaning}"
            )


def _few_blocks(used: Sequence[JointModel]) -> Iterator[Verdict]:
    """Whose uncertainty rests on few stretches of motion."""
    few = [m for m in used if 0 < m.blocks < ENOUGH]
    if few:
        message = (
            f"uncertainty of {', '.join(m.joint for m in few)} rests on {min(m.blocks for m in few)} stretches of "
        )
        message += f"motion that count as independent, fewer than {ENOUGH}: its intervals are wide; record longer"
        yield Verdict(STAGE, "ok", message)


def _told(model: JointModel) -> str:
    q = model.quality
    limit = " (its limit)" if limit_of(model.rho) else ""
    return (
        f"{model.joint} degree {model.degree}, rho {model.rho:.3g} s/rad{limit}, {1e3 * q.rms:.1f} -> "
        f"{1e3 * q.residual:.1f} mrad, R2 {q.r2:.2f}, left out {q.r2_out:.2f}"
    )
