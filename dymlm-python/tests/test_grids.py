"""2D grids for navigation, and their files as another program reads them."""

import os
from pathlib import Path

import dymlm
import numpy as np
import pytest
from conftest import inserted

UP = [0.0, 0.0, 1.0]


@pytest.fixture(scope="module")
def map(frames):
    return inserted(frames).finish()


@pytest.fixture(scope="module")
def robot(frames):
    """The camera's position, above the floor that it sees."""
    return frames[-1].world_from_camera.translation


def read_by_map_server(path):
    """Nav2's map_server, mode trinary: (height, width) int8 as nav_msgs/OccupancyGrid has it (100, 0, -1; row 0 has the
    lowest y), resolution, origin. After nav2_map_server/src/map_io.cpp."""
    yaml = pytest.importorskip("yaml")
    said = yaml.safe_load(Path(path).read_text())
    assert said["mode"] == "trinary" and said["negate"] in (0, False)
    magic, size, maximum, pixels = (Path(path).parent / said["image"]).read_bytes().split(b"\n", 3)
    if size.startswith(b"#"):
        size, maximum, pixels = maximum, *pixels.split(b"\n", 1)
    width, height = (int(word) for word in size.split())
    assert magic == b"P5" and int(maximum) == 255 and len(pixels) == width * height
    shade = np.frombuffer(pixels, np.uint8).reshape(height, width)[::-1] / 255.0
    occupied = 1.0 - shade
    states = np.full(shade.shape, -1, np.int8)
    states[occupied > said["occupied_thresh"]] = 100
    states[occupied < said["free_thresh"]] = 0
    x, y, yaw = (float(number) for number in said["origin"])
    assert yaw == 0.0
    return states, float(said["resolution"]), (x, y)


def test_regions_and_updates_are_the_whole_grid(frames):
    builder = inserted(frames[:6])
    before = builder.map()
    grid = before.octree.project(UP, 0.3, 1.5)
    region = [-1.0, -1.0, 1.0, 0.5]
    part = before.octree.project(UP, 0.3, 1.5, region=region)
    assert part.cells.shape == (30, 40) and np.allclose(part.origin, [-1.0, -1.0])
    for frame in frames[6:]:
        builder.insert_frame(frame)
    now = builder.map()
    updates = [one.update(before.octree, now.octree) for one in (grid, part)]
    assert all(0 < update.changed <= update.projected for update in updates) and not updates[1].has_grown
    left, right, low, high = updates[1].bounds
    assert 0 <= left <= right < 40 and 0 <= low <= high < 30
    assert np.array_equal(part.cells, now.octree.project(UP, 0.3, 1.5, region=region).cells)
    whole = now.octree.project(UP, 0.3, 1.5)
    x, y = np.round((whole.origin - grid.origin) / grid.resolution).astype(int)
    height, width = whole.cells.shape
    assert x >= 0 and y >= 0
    assert np.array_equal(grid.cells[y : y + height, x : x + width], whole.cells)


def test_floors_are_free_and_tables_are_not(map, robot):
    floor = map.floor_grid(robot, UP)
    cells = floor.grid.cells
    assert (cells == 1).sum() > 50 and (cells == 0).sum() > 200
    heights = floor.floor_heights([floor.grid.origin + 0.5, [1e3, 0.0]])
    assert abs(heights[0] - robot[2] + map.floor_under(robot, UP, 3.0, 3.0).distance) < 0.1 and np.isnan(heights[1])
    assert map.plane(floor.planes[0]).area > 0.25
    assert [one.planes[0] for one in map.floor_grids(UP)] == [floor.planes[0]]
    # Obstacles higher than the robot are not in its way.
    low = map.floor_grid(robot, UP, max_height=0.3)
    assert (low.grid.cells == 1).sum() < (cells == 1).sum()
    update = floor.update(map, map)
    assert (update.projected, update.changed, update.bounds) == (0, 0, None)


def test_inflation_is_a_margin(map, robot):
    grid = map.floor_grid(robot, UP, region=[-2.0, -2.0, 2.0, 2.0]).grid
    wide = grid.inflated(0.2)
    assert grid.cells.shape == wide.cells.shape == (80, 80)
    rows, columns = np.nonzero(grid.cells == 1)
    own_rows, own_columns = np.mgrid[:80, :80]
    squared = (own_rows[..., None] - rows) ** 2 + (own_columns[..., None] - columns) ** 2
    assert np.array_equal(wide.cells == 1, (squared <= 16).any(axis=-1))


def test_map_server_reads_the_files(map, robot, tmp_path):
    grid = map.floor_grid(robot, UP).grid
    grid.save(tmp_path, "floor")
    states, resolution, origin = read_by_map_server(tmp_path / "floor.yaml")
    assert np.array_equal(states, np.where(grid.cells == 1, 100, grid.cells))
    assert resolution == grid.resolution and np.array_equal(origin, grid.origin)
    assert set(np.unique(states)) == {-1, 0, 100}


def test_the_reader_reads_others_maps():
    """The reader above also reads Nav2's own maps."""
    data = Path(os.environ.get("DYMLM_DATA", Path(__file__).parents[3] / "shared" / "data")) / "floor_plans"
    if not data.exists():
        pytest.skip("Nav2's maps are not here")
    for name in ("depot", "warehouse"):
        states, resolution, _ = read_by_map_server(data / f"{name}.yaml")
        assert resolution < 0.1 and (states == 100).sum() > 1000 and (states == 0).sum() > 10_000


def test_what_is_no_grid_is_refused(map, robot):
    with pytest.raises(dymlm.Error, match="no floor is known under"):
        map.floor_grid([0.0, 0.0, -9.0], UP)
    with pytest.raises(dymlm.Error, match="floor_grid.max_step = 3"):
        map.floor_grid(robot, UP, max_step=3.0)
    with pytest.raises(dymlm.Error, match="max_stepp"):
        map.floor_grid(robot, UP, max_stepp=0.1)
    with pytest.raises(dymlm.Error, match=r"region of shape \[2\]"):
        map.octree.project(UP, 0.0, 1.0, region=[0.0, 1.0])
    with pytest.raises(dymlm.Error, match="no grid from"):
        map.floor_grid(robot, UP, region=[1.0, 1.0, 0.0, 0.0])
    with pytest.raises(dymlm.Error, match="inflated by -1 m"):
        map.floor_grid(robot, UP).grid.inflated(-1.0)
    with pytest.raises(dymlm.Error, match="no projection"):
        map.floor_grids([0.0, 0.0, 0.0])
