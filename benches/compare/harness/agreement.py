"""Whether the contestants compute the same: one function per operation, from output files to a verdict for each."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .files import Leaves, read_core, read_labels, read_leaves, read_numbers, read_points, read_states, voxel_means
from .inputs import VOXEL
from .pose_graphs import pose_graph_cost, read_edges


@dataclass
class Agreement:
    """`good` is False only when an exact promise does not hold."""

    text: str
    good: bool = True
    # Whether this is a solution at all: ours is not compared with a peer that has none.
    reached: bool = True


Outputs = dict[str, Path]
OURS = "dymlm"


def ours(outputs: Outputs) -> list[str]:
    return [name for name in outputs if name.startswith(OURS)]


def static_cloud(parameters: dict, outputs: Outputs) -> dict[str, Agreement]:
    """Residue of movers and completeness of the rest, in voxels: the score of `dymlm_metrics::ReferenceCloud`."""
    from scipy.spatial import cKDTree

    folder = Path(parameters["poses"]).parent
    reference = cKDTree(read_points(folder / "reference.points"))
    asked = read_points(folder / "asked.points")
    agreements = {}
    for name, path in outputs.items():
        found = voxel_means(read_points(path).astype(np.float64), VOXEL)
        residue = np.mean(reference.query(found)[0] > 0.06)
        completeness = np.mean(cKDTree(found).query(asked)[0] <= 0.05)
        agreements[name] = Agreement(f"residue {100 * residue:.3f} %, completeness {100 * completeness:.2f} %")
    return agreements


def dbscan(_: dict, outputs: Outputs) -> dict[str, Agreement]:
    """Against scikit-learn: same clusters of core points, same noise. Border points may go to any cluster in reach."""
    reference = "scikit-learn"
    if reference not in outputs:
        return {name: Agreement("no scikit-learn to compare with") for name in outputs}
    labels, core = read_labels(outputs[reference]), read_core(outputs[reference])
    clusters, noise = labels.max() + 1, np.count_nonzero(labels < 0)
    agreements = {reference: Agreement(f"the reference: {clusters} clusters, {noise} noise, {core.sum()} core points")}
    for name, path in outputs.items():
        if name == reference:
            continue
        other = read_labels(path)
        moved = np.count_nonzero(core) - matched(labels[core], other[core])
        noise_differs = np.count_nonzero((labels < 0) != (other < 0))
        border = np.count_nonzero(~core & (labels >= 0))
        elsewhere = border - matched_like(labels, other, core, ~core & (labels >= 0))
        same = moved == 0 and noise_differs == 0 and other.max() + 1 == clusters
        if same:
            text = f"same clusters of core points, same noise; {elsewhere} of {border} border points elsewhere"
        else:
            text = f"{other.max() + 1} clusters, {moved} core points elsewhere, noise differs at {noise_differs} points"
        agreements[name] = Agreement(text, same or name not in ours(outputs))
    return agreements


def partners(a: np.ndarray, b: np.ndarray) -> dict[int, int]:
    """For each label of `a`, the label of `b` with which it shares most points, if the same holds in reverse."""
    pairs, counts = np.unique(np.stack([a, b]), axis=1, return_counts=True)
    best_of_a, best_of_b = {}, {}
    for (left, right), _ in sorted(zip(pairs.T.tolist(), counts.tolist()), key=lambda pair: -pair[1]):
        if left >= 0 and right >= 0:
            best_of_a.setdefault(left, right)
            best_of_b.setdefault(right, left)
    return {left: right for left, right in best_of_a.items() if best_of_b[right] == left}


def matched(a: np.ndarray, b: np.ndarray) -> int:
    """Number of points whose labels correspond."""
    return count_partners(partners(a, b), a, b)


def matched_like(a: np.ndarray, b: np.ndarray, learn: np.ndarray, ask: np.ndarray) -> int:
    """Number of points of `ask` whose labels correspond in the way that those of `learn` do."""
    return count_partners(partners(a[learn], b[learn]), a[ask], b[ask])


def count_partners(partner: dict[int, int], a: np.ndarray, b: np.ndarray) -> int:
    # Noise, -1, indexes the last entry, which corresponds to nothing.
    table = np.full(max([a.max(initial=0), *partner]) + 2, -2)
    for left, right in partner.items():
        table[left] = right
    return int(np.count_nonzero(table[a] == b))


def voxel_grid(parameters: dict, outputs: Outputs) -> dict[str, Agreement]:
    """Against the definition, computed here: voxel floor(p / size), centroid in double precision."""
    size = parameters["voxel_size"]
    keys, centroids = exact_voxels(read_points(Path(parameters["input"])), size)
    agreements = {}
    for name, path in outputs.items():
        points = read_points(path)
        if name == "Open3D":
            text = f"{len(points)} voxels of {len(keys)}; its lattice begins at the cloud's corner"
            agreements[name] = Agreement(text)
            continue
        # A centroid may be rounded onto its voxel's border, so it is found by the nearest centroid instead of
        # its key.
        distance = nearest_distances(centroids, points)
        off = np.count_nonzero(distance > 1e-5)
        text = f"{len(points)} voxels of {len(keys)}, centroids within {distance.max() * 1e3:.2g} mm"
        if off:
            text += f", {off} off by more than 0.01 mm: points on a border between voxels"
        exact = len(points) == len(keys) and distance.max() <= 1e-6
        agreements[name] = Agreement(text, exact or name not in ours(outputs))
    return agreements


def exact_voxels(points: np.ndarray, size: float) -> tuple[np.ndarray, np.ndarray]:
    points = points.astype(np.float64)
    index = np.floor(points * (1 / size)).astype(np.int64)
    packed = ((index[:, 0] + (1 << 20)) << 42) | ((index[:, 1] + (1 << 20)) << 21) | (index[:, 2] + (1 << 20))
    keys, voxel, counts = np.unique(packed, return_inverse=True, return_counts=True)
    sums = [np.bincount(voxel, weights=points[:, axis]) for axis in range(3)]
    return keys, np.stack(sums, axis=1) / counts[:, None]


def nearest_distances(points: np.ndarray, queries: np.ndarray) -> np.ndarray:
    from scipy.spatial import cKDTree

    return cKDTree(points).query(queries.astype(np.float64))[0]


def octree_leaves(parameters: dict, outputs: Outputs) -> dict[str, Agreement]:
    """Ours against OctoMap: same leaves, same log-odds to the bit. Other maps against ours: their occupied cells."""
    maps = {name: read_leaves(path) for name, path in outputs.items()}
    reference = octomap(outputs)
    agreements = {}
    for name, found in maps.items():
        if name in ours(outputs):
            agreements[name] = same_leaves(found, maps.get(reference))
        elif name == reference:
            agreements[name] = Agreement(f"the reference: {found.nodes} nodes, {len(found.leaves)} leaves")
        elif OURS not in maps:
            agreements[name] = Agreement("no dymlm to compare with")
        else:
            # After one scan, what is occupied is what was hit, whatever way the rays take; after more, ways differ.
            promised = parameters["limit"] == 1 and "projective" not in name
            agreements[name] = same_surfaces(found, maps[OURS], promised)
        agreements[name].text += f"; {found.bytes / 1e6:.1f} MB"
    return agreements


def octomap(outputs: Outputs) -> str | None:
    """OctoMap's name in this row, if it ran: our octree promises to be what OctoMap's is."""
    return next((name for name in outputs if name.startswith("OctoMap")), None)


def same_leaves(mine: Leaves, theirs: Leaves | None) -> Agreement:
    if theirs is None:
        return Agreement("no OctoMap to compare with")
    if mine.nodes == theirs.nodes and np.array_equal(mine.leaves, theirs.leaves):
        return Agreement("same nodes, same leaves, same log-odds to the bit")
    both = np.intersect1d(mine.leaves.view("V12"), theirs.leaves.view("V12"))
    return Agreement(f"{mine.nodes} nodes, {len(mine.leaves)} leaves, of which {len(both)} are equal", good=False)


def same_surfaces(theirs: Leaves, mine: Leaves, promised: bool) -> Agreement:
    found, expected = theirs.occupied_cells(), mine.occupied_cells()
    shared = len(np.intersect1d(found, expected))
    if promised and len(found) == len(expected) == shared:
        return Agreement(f"the same {shared} occupied cells")
    return Agreement(f"{len(found)} occupied cells, ours {len(expected)}, in both {shared}", good=not promised)


def octree_hits(_: dict, outputs: Outputs) -> dict[str, Agreement]:
    """Against OctoMap: the same rays hit the same cells."""

    def tally(hits):
        return f"{np.count_nonzero(~np.isnan(hits[:, 0]))} of {len(hits)} rays hit"

    return exactly_equal(outputs, read_points, "rays end at the same cells", tally)


def octree_states(_: dict, outputs: Outputs) -> dict[str, Agreement]:
    """Against OctoMap: same states."""

    def tally(states):
        unknown, free, occupied = np.bincount(states, minlength=3)
        return f"{occupied} occupied, {free} free, {unknown} unknown"

    return exactly_equal(outputs, read_states, "same states", tally)


def exactly_equal(outputs: Outputs, read, same: str, describe) -> dict[str, Agreement]:
    """Ours must answer as OctoMap does; how many answers of other maps, which take other ways, do is shown."""
    reference = octomap(outputs)
    if reference is None:
        return {name: Agreement("no OctoMap to compare with") for name in outputs}
    theirs = read(outputs[reference])
    agreements = {reference: Agreement("the reference: " + describe(theirs))}
    for name in outputs:
        if name == reference:
            continue
        mine, promised = read(outputs[name]), name in ours(outputs)
        if mine.shape != theirs.shape:
            agreements[name] = Agreement(f"{len(mine)} answers, not {len(theirs)}", good=not promised)
            continue
        # NaN, the centre when no cell was hit, equals NaN.
        equal = (mine == theirs) | ((mine != mine) & (theirs != theirs))
        differ = len(equal) - np.count_nonzero(equal.reshape(len(equal), -1).all(axis=1))
        text = f"{differ} of {len(equal)} differ" if differ else same
        agreements[name] = Agreement(text, good=differ == 0 or not promised)
    return agreements


def minimum_area_rectangle(parameters: dict, outputs: Outputs) -> dict[str, Agreement]:
    """Against the definition, computed here: least area over the edges of the hull, with all points inside."""
    points = read_points(Path(parameters["input"]))[:, :2].astype(np.float64)
    hull, least = least_rectangle(points)
    agreements = {}
    for name, path in outputs.items():
        corners = read_numbers(path).reshape(4, 2)
        along, across = corners[1] - corners[0], corners[3] - corners[0]
        lengths = np.linalg.norm([along, across], axis=1)
        offsets = np.abs((hull - corners.mean(axis=0)) @ (np.array([along, across]) / lengths[:, None]).T)
        excess, area = (offsets - lengths / 2).max(), lengths.prod()
        text = f"area {area / least - 1:+.0e} of the least, points outside by up to {max(excess, 0):.0e} m"
        exact = abs(area / least - 1) <= 1e-12 and excess <= 1e-12
        agreements[name] = Agreement(text, exact or name not in ours(outputs))
    return agreements


def least_rectangle(points: np.ndarray) -> tuple[np.ndarray, float]:
    """The corners of the hull, and the least area over its edges, found by projecting all corners onto each edge."""
    from scipy.spatial import ConvexHull

    hull = points[ConvexHull(points).vertices]
    edges = np.roll(hull, -1, axis=0) - hull
    along = edges / np.linalg.norm(edges, axis=1)[:, None]
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    centered = hull - hull.mean(axis=0)
    areas = np.ptp(centered @ along.T, axis=0) * np.ptp(centered @ across.T, axis=0)
    return hull, float(areas.min())


def oriented_box(parameters: dict, outputs: Outputs) -> dict[str, Agreement]:
    """Whether all points are inside each box, and its volume relative to the smallest of all."""
    points = read_points(Path(parameters["input"])).astype(np.float64)
    boxes = {}
    for name, path in outputs.items():
        numbers = read_numbers(path)
        center, rotation, lengths = numbers[:3], numbers[3:12].reshape(3, 3), numbers[12:]
        boxes[name] = lengths.prod(), (np.abs((points - center) @ rotation) - lengths / 2).max()
    least = min(volume for volume, _ in boxes.values())
    agreements = {}
    for name, (volume, excess) in boxes.items():
        text = f"{volume / least - 1:.1%} above the smallest, points outside by up to {max(excess, 0):.0e} m"
        agreements[name] = Agreement(text, excess <= 1e-12 or name not in ours(outputs))
    return agreements


def isolation_forest(parameters: dict, outputs: Outputs) -> dict[str, Agreement]:
    """Against scikit-learn: the random trees differ, but the stray points must be found equally well."""
    reference = "scikit-learn"
    if reference not in outputs:
        return {name: Agreement("no scikit-learn to compare with") for name in outputs}
    scores = {name: read_numbers(path) for name, path in outputs.items()}
    # As made by harness/inputs.py.
    stray = np.arange(len(scores[reference])) % 100 == 0
    areas = {name: area_under_curve(of, stray) for name, of in scores.items()}
    agreements = {}
    for name, of in scores.items():
        difference = np.abs(of - scores[reference]).mean()
        text = f"strays found with ROC-AUC {areas[name]:.3f}, scores differ by {difference:.3f} in the mean"
        alike = abs(areas[name] - areas[reference]) <= 0.02 and difference <= 0.02
        agreements[name] = Agreement(text, alike or name not in ours(outputs))
    return agreements


def area_under_curve(scores: np.ndarray, positive: np.ndarray) -> float:
    """Probability that a positive scores above a negative."""
    from scipy.stats import rankdata

    count = positive.sum()
    return (rankdata(scores)[positive].sum() - count * (count + 1) / 2) / (count * (len(scores) - count))


# Two planes are the same when their normals differ by at most this angle, and their offsets, at the centroid
# of one, by at most this distance: degrees, metres.
SAME_ANGLE, SAME_OFFSET = 5.0, 0.03
# Number of pixels of a large plane: a table top, a floor, a counter.
LARGE = 15_000


def planes(_: dict, outputs: Outputs) -> dict[str, Agreement]:
    """Against each other: every large plane that all peers find, two at least, must be among ours."""
    found = {name: facing_camera(read_numbers(path).reshape(-1, 9)) for name, path in outputs.items()}
    peers = [name for name in found if name not in ours(outputs)]
    large = [row for name in peers for row in found[name] if row[8] >= LARGE]
    finders = [sum(match(row, found[peer]) is not None for peer in peers) for row in large]
    agreed = without_repeats([row for row, count in zip(large, finders) if count == len(peers)])
    usual = without_repeats([row for row, count in zip(large, finders) if count > len(peers) / 2])
    agreements = {}
    for name, rows in found.items():
        text = f"{len(rows)} planes, {np.count_nonzero(rows[:, 8] >= LARGE)} large"
        good = True
        if name not in peers and peers:
            matches = [match(row, rows) for row in agreed]
            missed = sum(other is None for other in matches)
            angle, offset = np.max([(0.0, 0.0), *(other for other in matches if other)], axis=0)
            text += f"; of the {len(agreed)} large ones that all peers find {len(agreed) - missed}, "
            text += f"within {angle:.1f} deg and {offset * 1e3:.0f} mm"
            text += f"; of the {len(usual)} that most find {sum(match(row, rows) is not None for row in usual)}"
            good = missed == 0 or len(peers) < 2
        elif peers:
            mine = found[next(iter(ours(outputs)), name)]
            big = [row for row in mine if row[8] >= LARGE]
            text += f"; of our {len(big)} large ones {sum(match(row, rows) is not None for row in big)}"
        agreements[name] = Agreement(text, good)
    return agreements


def facing_camera(rows: np.ndarray) -> np.ndarray:
    """The same planes with their normals towards the camera: some libraries leave it open where a normal points."""
    rows[rows[:, 4] < 0, 1:5] *= -1
    return rows


def match(row: np.ndarray, others: np.ndarray) -> tuple[float, float] | None:
    """Angle and offset to the nearest of the planes in the same image that are the same plane as `row`, if any."""
    others = others[others[:, 0] == row[0]]
    angles = np.degrees(np.arccos(np.clip(others[:, 1:4] @ row[1:4], -1, 1)))
    offsets = np.abs(others[:, 1:4] @ row[5:8] + others[:, 4])
    same = np.flatnonzero((angles <= SAME_ANGLE) & (offsets <= SAME_OFFSET))
    if len(same) == 0:
        return None
    best = same[np.argmin(offsets[same])]
    return float(angles[best]), float(offsets[best])


def without_repeats(rows: list[np.ndarray]) -> list[np.ndarray]:
    """Each plane once."""
    kept: list[np.ndarray] = []
    for row in rows:
        if match(row, np.reshape(kept, (-1, 9))) is None:
            kept.append(row)
    return kept


def assignment(_: dict, outputs: Outputs) -> dict[str, Agreement]:
    """Against scipy: the same sums of weights."""
    reference = "scipy"
    if reference not in outputs:
        return {name: Agreement("no scipy to compare with") for name in outputs}
    sums = read_numbers(outputs[reference])
    agreements = {reference: Agreement(f"the reference: {len(sums)} matrices")}
    for name in ours(outputs):
        same = np.count_nonzero(read_numbers(outputs[name]) == sums)
        agreements[name] = Agreement(f"same sum in {same} of {len(sums)} matrices", bool(same == len(sums)))
    return agreements


# Least costs of the field's pose graphs, found by GTSAM 4.2's Levenberg-Marquardt.
OPTIMA = {"parking-garage": 0.634192399, "sphere2500": 675.70096296}
# Largest share by which our cost may differ from the least one, and beyond which a peer has missed it.
COST_LIMIT = 1e-3


def pose_graph(parameters: dict, outputs: Outputs) -> dict[str, Agreement]:
    """All poses by one cost, `pose_graph_cost`: ours must be within a thousandth of the known least cost."""
    graph = Path(parameters["graph"])
    edges, optimum, agreements = read_edges(graph), OPTIMA[graph.stem], {}
    for name, path in outputs.items():
        iterations, *poses = read_numbers(path)
        cost = pose_graph_cost(np.reshape(poses, (-1, 7)), edges)
        excess = cost / optimum - 1
        # Limited in both directions: a lower cost would mean that another problem was solved.
        good = abs(excess) <= COST_LIMIT
        text = f"cost {cost:.7g}, {excess:+.1e} of the least; {iterations:.0f} iterations"
        agreements[name] = Agreement(text, bool(good or name not in ours(outputs)), reached=bool(good))
    return agreements


def optical_flow(parameters: dict, outputs: Outputs) -> dict[str, Agreement]:
    """Against the truth: our median end-point error may not exceed OpenCV's by more than a hundredth of a pixel."""
    truth = np.fromfile(parameters["points"], dtype="<f4").reshape(-1, 4)[:, 2:]
    errors = {
        name: np.linalg.norm(np.fromfile(path, dtype="<f4").reshape(-1, 2) - truth, axis=1)
        for name, path in outputs.items()
    }
    worst = max((np.median(error) for name, error in errors.items() if name not in ours(outputs)), default=np.inf)
    return {
        name: Agreement(
            f"end-point error {np.median(error):.4f} px (median), {np.percentile(error, 90):.2f} px (90 %)",
            name not in ours(outputs) or bool(np.median(error) <= worst + 0.01),
        )
        for name, error in errors.items()
    }


def tracked_boxes(parameters: dict, outputs: Outputs) -> dict[str, Agreement]:
    """Against the truth: our mean overlap may not be below OpenCV's. The given first box of a track is left out."""
    targets = np.fromfile(parameters["targets"], dtype="<f4").reshape(-1, 6)
    found = np.append(False, np.diff(targets[:, 0]) == 0)
    overlaps = {
        name: overlap(np.fromfile(path, dtype="<f4").reshape(-1, 4), targets[:, 2:])[found].mean()
        for name, path in outputs.items()
    }
    best = max((value for name, value in overlaps.items() if name not in ours(outputs)), default=0)
    return {
        name: Agreement(f"mean overlap {value:.3f}", name not in ours(outputs) or bool(value >= best))
        for name, value in overlaps.items()
    }


def overlap(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Intersection over union, row by row."""
    sides = np.minimum(a[:, 2:], b[:, 2:]) - np.maximum(a[:, :2], b[:, :2])
    shared = np.clip(sides, 0, None).prod(axis=1)
    return shared / ((a[:, 2:] - a[:, :2]).prod(axis=1) + (b[:, 2:] - b[:, :2]).prod(axis=1) - shared)
