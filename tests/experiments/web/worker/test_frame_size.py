"""The size of frames follows the machine, the link and the view, and does not go to and fro."""

from experiments.web.worker.encoders import (
    FIRST_SIZE,
    FRAMES,
    HELD_UP,
    QUICK,
    RETRY,
    SIZES,
    SLOW,
    FrameSize,
    pause_after,
)

COST = (0.013, 0.018, 0.025, 0.034, 0.047)  # s of a frame of each size, on a software renderer


def settled(size, cost, waiting=lambda _: 0.0, frames=20 * FRAMES):
    """Indices of the size over so many frames that cost and wait what their size says."""
    seen = []
    for _ in range(frames):
        seen.append(size.index)
        size.note(cost(size.index), waiting(size.index))
    return seen


def test_a_machine_has_the_size_that_it_can_draw_and_keeps_it():
    for slowness in (0.2, 0.5, 1.0, 1.5, 2.0, 3.0):
        size = FrameSize()
        size.limit(4000, 4000)
        seen = settled(size, lambda index, s=slowness: s * COST[index])
        last = seen[-10 * FRAMES :]
        assert len(set(last)) == 1, f"{slowness} times as slow: {seen}"
        assert slowness * COST[last[0]] <= SLOW or last[0] == 0
        largest = last[0] == len(SIZES) - 1
        assert largest or slowness * COST[last[0] + 1] >= 0.8 * SLOW, "no smaller than need be"
    assert settled(FrameSize(), lambda _: 0.001)[-1] == len(SIZES) - 1
    assert settled(FrameSize(), lambda _: 0.5)[-1] == 0


def test_one_slow_frame_changes_nothing():
    size = FrameSize()
    for i in range(10 * FRAMES):
        size.note(0.5 if i % 9 == 0 else (QUICK + SLOW) / 2, 0.0)
    assert size.index == FIRST_SIZE


def test_frames_are_no_larger_than_the_view():
    size = FrameSize()
    size.limit(500, 400)
    assert SIZES[size.index] == (480, 360)
    assert settled(size, lambda _: 0.001)[-1] == 1
    size.limit(100, 100)
    assert size.index == 0


def test_a_link_that_holds_frames_up_has_smaller_ones_and_is_tried_again_later():
    now = [0.0]
    size = FrameSize(lambda: now[0])

    def waiting(index):
        return 2 * HELD_UP if index > 0 else 0.0

    assert set(settled(size, lambda _: 0.001, waiting)[-10 * FRAMES :]) == {0}
    now[0] += RETRY + 1.0
    assert settled(size, lambda _: 0.001)[-1] == len(SIZES) - 1


def test_drawing_leaves_time_to_others():
    assert pause_after(SLOW) + SLOW <= 1.0 / 15.0, (
        "15 frames a second at the slowest time that keeps its size"
    )
