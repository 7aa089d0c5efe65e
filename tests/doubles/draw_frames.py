"""docs/frames.svg, drawn again: python -m tests.draw_frames."""

from pathlib import Path

from scenarios.plots import FRAME_CHAIN, drawing, figure, frame_chain, svg


def frames_svg() -> str:
    with drawing():
        page = figure(*FRAME_CHAIN)
        frame_chain(page.add_axes((0.0, 0.0, 1.0, 1.0)))
    return svg(page, "frames")


if __name__ == "__main__":
    (Path(__file__).parents[2] / "docs/frames.svg").write_text(frames_svg(), encoding="utf-8", newline="\n")
