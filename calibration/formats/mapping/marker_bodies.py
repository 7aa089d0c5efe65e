"""The marker bodies of a mapping with all coordinates: drawn ones as they are, undrawn ones from the recording.

Where markers sit that nobody measured: their shape from the recording, their place by the base or the nominal robot.

    shape      mean over all samples of the cluster that have one shape, see marker_shape
    standing   x_m = T_lab_base^-1 p_m, the base frame declared to stand at (x, y, heading) in the first second
    fitted     B_i = X A_i Y     A_i nominal T_base_hand(q_i), B_i measured; closed form: for all pairs of postures
               log(A_i^-1 A_j) = R_Y log(B_i^-1 B_j), R_X by the mean, then both translations linearly

X places the frame of the marker positions on the base, Y the cluster on its link. Both are only starting points: the
stages fit them again, with the tolerances the setup declares.
Reference: Park, Martin, IEEE Trans. Robotics and Automation 1994 (hand-eye calibration on the Euclidean group).
"""

from collections.abc import Mapping as Lookup
from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from calibration.errors import InputError, NotEnoughData
from calibration.formats.mapping.channels import Recorded
from calibration.formats.mapping.dwell_means import posture_means
from calibration.formats.mapping.mapping import MappedBody, MappingFile
from calibration.formats.mapping.poses import other_convention
from calibration.mocap.cluster_pose import body_poses
from calibration.mocap.cluster_shape import cluster, misfit, of_one_shape
from calibration.numerics.alignment import hand_eye, registration_start
from calibration.numerics.lie import compose, inverse, to_vector
from calibration.recording.schema import Body, Marker
from calibration.recording.trial import REST
from calibration.robot.chain import Chain

_FEWEST = 6  # postures that place a point


def placed_bodies(mapping: MappingFile, chain: Chain, calibration: Sequence[Recorded]) -> tuple[Body, ...]:
    """All bodies, those to be placed by the calibration trials placed.

    Raises:
        InputError: The recordings do not allow it.
    """
    mapped = mapping.content.bodies
    bodies = {b.name: _with_shape(mapping, b, calibration) for b in mapped}
    if any(b.fitted for b in mapped):
        bodies |= _fitted(mapping, chain, bodies, calibration)
    return tuple(bodies.values())


def _with_shape(mapping: MappingFile, body: MappedBody, calibration: Sequence[Recorded]) -> Body:
    if not body.undrawn:
        return body.drawn()
    if not calibration:
        raise mapping.error(f"bodies.{body.name}", "undrawn, and there is no calibration trial to take it from")
    try:
        if body.standing is None:
            xyz = mean_shape(np.concatenate([_positions(r, body.undrawn) for r in calibration]))
        else:
            s, first = body.standing, calibration[0]
            xyz = standing_shape(_positions(first, body.undrawn, rest=True), s.x, s.y, s.heading)
    except NotEnoughData as error:
        raise InputError(calibration[0].file, f"body {body.name!r}: {error}") from error
    coordinates = [(float(x), float(y), float(z)) for x, y, z in xyz]
    markers = tuple(Marker(name=n, xyz=p) for n, p in zip(body.undrawn, coordinates, strict=True))
    return Body(name=body.name, link=body.link, markers=markers)


def _positions(recorded: Recorded, names: Sequence[str], rest: bool = False) -> np.ndarray:
    """Positions (n, m, 3) of some markers, at rest those of the first second."""
    group = recorded.means or recorded.markers
    known: Sequence[str] = () if group is None else group.markers if recorded.means else group.names  # type: ignore[union-attr]
    missing = [name for name in names if name not in known]
    if group is None or missing:
        raise InputError(recorded.file, f"markers {missing} of an undrawn body are not in the file")
    p = group.position[:, [known.index(name) for name in names]]
    if rest and recorded.markers is not None:
        p = p[recorded.markers.t <= recorded.markers.t[0] + REST]
    return p


def _fitted(
    mapping: MappingFile, chain: Chain, bodies: Lookup[str, Body], calibration: Sequence[Recorded]
) -> dict[str, Body]:
    """Base and hand with placements from the nominal robot at the postures."""
    together = {name for r in calibration for name in r.together} | set(mapping.content.setup.mocap_clock)
    postures = [r for r in calibration if r.means is not None]
    postures += posture_means(calibration, "robot" in together)
    names = mapping.content.base_name, mapping.content.hand_name
    missing = [link for name, link in zip(names, ("base_frame", "tool_frame"), strict=True) if name not in bodies]
    if missing or not postures:
        place, why = (
            ("bodies", f"none on the {missing[0]}") if missing else ("trials", "no calibration file of postures")
        )
        raise mapping.error(place, f"{why}; a fitted body is placed by base and hand in static postures")
    base, hand = (bodies[name] for name in names)
    readings = [in_order(r, chain.measured) for r in postures]
    A = np.concatenate([inverse(chain.poses(q, base.link)) @ chain.poses(q, hand.link) for q in readings])
    placed = _pointed if hand.is_point else _posed
    found = dict(zip(names, placed(mapping, base, hand, A, postures), strict=True))
    fitted = [b.name for b in mapping.content.bodies if b.fitted and b.name in found]
    return {n: bodies[n].model_copy(update={"placement": tuple(map(float, found[n]))}) for n in fitted}


def _posed(
    mapping: MappingFile, base: Body, hand: Body, A: np.ndarray, postures: Sequence[Recorded]
) -> tuple[np.ndarray, np.ndarray]:
    """Placements (6,) of base and hand from nominal poses A (n, 4, 4) of hand's link in the base's."""
    B = np.concatenate([inverse(_poses(base, r)) @ _poses(hand, r) for r in postures])
    posed = next((b.pose for b in mapping.content.bodies if b.name == hand.name), None)
    if posed is not None and (other := other_convention(A, B, posed.order)) is not None:
        what = f"as declared ({posed.order}) they contradict the joint readings, as {other} they do not"
        raise InputError(postures[0].file, f"poses of {hand.name}: {what}; correct the mapping")
    try:
        X, Y = hand_eye(A, B)
    except NotEnoughData as error:
        raise InputError(postures[0].file, str(error)) from error
    return to_vector(inverse(X)), to_vector(Y)


def _pointed(
    mapping: MappingFile, base: Body, hand: Body, A: np.ndarray, postures: Sequence[Recorded]
) -> tuple[np.ndarray, np.ndarray]:
    """Placements of base and hand where one marker of the hand is seen: its place, the hand not turned."""
    names = [m.name for m in hand.markers]
    if len(names) > 1 or base.markers:
        raise mapping.error("bodies", "a hand of fewer than three markers is fitted by one, in the base's own frame")
    y = np.concatenate([_positions(r, names)[:, 0] for r in postures])
    good = np.isfinite(y).all(axis=1)
    if good.sum() < _FEWEST:
        raise InputError(postures[0].file, f"{good.sum()} postures show the hand; {_FEWEST} are needed to place it")
    frames = registration_start(A[good], compose(np.tile(np.eye(3), (int(good.sum()), 1, 1)), y[good]), False).frames
    return frames[:6], frames[6:]


def in_order(recorded: Recorded, joints: Sequence[str]) -> np.ndarray:
    """Readings of static postures (n, k) in the order of `joints`."""
    means = recorded.means
    if means is None:
        raise InputError(recorded.file, "holds no static postures")
    missing, unknown = unmatched(means.joints, joints)
    if missing or unknown:
        what = f"{missing} of the setup are not mapped, {unknown} are not in the setup"
        raise InputError(recorded.file, f"joints: {what}")
    return means.q[:, [means.joints.index(name) for name in joints]]


def unmatched(found: Sequence[str], wanted: Sequence[str]) -> tuple[list[str], list[str]]:
    """Names that are wanted but not found, and found but not wanted."""
    return [n for n in wanted if n not in found], [n for n in found if n not in wanted]


def _poses(body: Body, recorded: Recorded) -> np.ndarray:
    """Poses (n, 4, 4); NaN where its markers do not have its shape: labels exchanged, a ghost."""
    if not body.markers:
        return np.eye(4)[None]
    found = body_poses(np.array([m.xyz for m in body.markers]), _positions(recorded, [m.name for m in body.markers]))
    return np.where(of_one_shape(misfit(found.residual))[:, None, None], found.T, np.nan)


def mean_shape(positions: np.ndarray) -> np.ndarray:
    """Shape (m, 3) [m] of a cluster from positions (n, m, 3), about its centre; NaN positions are left out.

    Raises:
        NotEnoughData: No sample shows all markers.
    """
    whole = positions[np.isfinite(positions).all(axis=(1, 2))]
    if not len(whole):
        raise NotEnoughData("no sample shows all of its markers together, so its shape is not known")
    if whole.shape[1] == 1:
        return np.zeros((1, 3))
    if whole.shape[1] == 2:
        raise NotEnoughData("two markers show no frame of a body: give one of them alone, three, or both drawn")
    shape = cluster(whole).xyz
    return np.asarray(shape - shape.mean(axis=0))


def standing_shape(positions: np.ndarray, x: float, y: float, heading: float) -> np.ndarray:
    """Marker coordinates (m, 3) [m, base] from positions at rest (n, m, 3) [m, lab] of a base that stands upright."""
    T = compose(Rotation.from_rotvec([0.0, 0.0, heading]).as_matrix(), np.array([x, y, 0.0]))
    at_rest = np.nanmean(positions, axis=0)
    return (at_rest - T[:3, 3]) @ T[:3, :3]
