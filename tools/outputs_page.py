"""Write the table of outputs in docs/outputs.md from their registry."""

from __future__ import annotations

from pathlib import Path

from dermis.base.command_line import run_script
from dermis.scene.outputs import OUTPUTS, Output

PAGE = Path(__file__).resolve().parents[1] / "docs" / "outputs.md"
_BEGIN, _END = "<!-- outputs -->\n", "<!-- end -->\n"


def main() -> None:
    """Write the table."""
    PAGE.write_text(page(PAGE.read_text("utf-8")), "utf-8")


def page(text: str) -> str:
    """Return the text of the page with the current table."""
    before, _, rest = text.partition(_BEGIN)
    return f"{before}{_BEGIN}{table()}{_END}{rest.partition(_END)[2]}"


def table() -> str:
    """Return the table with one row per output."""
    columns = "name", "what", "unit", "numbers", "channels in OpenEXR", "PNG", "where nothing is seen"
    rows = [columns, ["---"] * len(columns), *map(_cells, OUTPUTS.values())]
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


def _cells(output: Output) -> list[str]:
    each = f"{output.channels} x {output.kind}" if output.channels else f"{output.kind} for each light"
    channels = ", ".join(f"`{output.name}.{letter}`" for letter in output.channel_names or "012")
    channels += "" if output.channel_names else ", ..."
    cells = [f"`{output.name}`", output.description, output.unit, each.removeprefix("1 x ")]
    return [*cells, channels, _png(output), f"{output.background:g}"]


def _png(output: Output) -> str:
    if output.kind == "uint8":
        return "8 bit, unscaled"
    if output.quantisation is None:
        return "none"
    step, zero = output.quantisation
    shown = f"{step:g}" if round(step, 3) == step else f"1/{round(1 / step)}"
    return f"(level - {zero}) x {shown}" if zero else f"level x {shown}"


if __name__ == "__main__":
    run_script(main)
