import dymlm
import pytest


@pytest.fixture(scope="session")
def frames():
    """Six seconds of the built-in sequence at two frames a second, in small images."""
    camera = dymlm.Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
    sequence = dymlm.builtin_sequence(frames=60, every=5, camera=camera)
    return [sequence[index] for index in range(len(sequence))]


def inserted(frames, **fields):
    builder = dymlm.MapBuilder(frames[0].camera, dymlm.Config(**fields))
    for frame in frames:
        builder.insert_frame(frame)
    return builder


def same(one, other):
    """Whether two maps are the same to the bit in all that their arrays show."""
    clouds = [map.cloud("all") for map in (one, other)]
    leaves = [map.octree.leaves() for map in (one, other)]
    planes = [[(p.id, *p.normal, p.offset, p.area) for p in map.planes] for map in (one, other)]
    things = [[(o.id, o.label, *o.center, *o.size) for o in map.objects] for map in (one, other)]
    return (
        clouds[0].positions.tobytes() == clouds[1].positions.tobytes()
        and clouds[0].colors.tobytes() == clouds[1].colors.tobytes()
        and all(a.tobytes() == b.tobytes() for a, b in zip(*leaves, strict=True))
        and planes[0] == planes[1]
        and things[0] == things[1]
    )
