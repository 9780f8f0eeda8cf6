"""The machine as a small drawing with the places marked where effects act."""

from __future__ import annotations

from collections.abc import Collection

PARTS = ("motor", "reducer", "cam", "table", "base", "sensor")

_LABELS = {
    "motor": (52, 120, "motor"),
    "reducer": (149, 110, "reducer, joint 1"),
    "cam": (268, 196, "cam and rollers, joint 2"),
    "table": (268, 34, "table"),
    "base": (198, 262, "base, joint 3"),
    "sensor": (398, 66, "sensor"),
}
"""Where each part's name stands."""

_SHAPES = {
    "motor": '<rect x="22" y="128" width="60" height="48" rx="5"/><path d="M32 128v48M44 128v48M56 128v48M68 128v48"/>',
    "reducer": '<rect x="118" y="118" width="62" height="62" rx="5"/><circle cx="139" cy="149" r="13"/>'
    '<circle cx="161" cy="149" r="9"/>',
    "cam": '<ellipse cx="268" cy="152" rx="46" ry="24"/><path d="M236 140q32 34 64 2"/>'
    '<circle cx="244" cy="118" r="7"/><circle cx="268" cy="112" r="7"/><circle cx="292" cy="118" r="7"/>',
    "table": '<rect x="186" y="62" width="164" height="16" rx="4"/><path d="M268 78v26"/>'
    '<path d="M200 62v-12h20v12M316 62v-12h20v12"/>',
    "base": '<path d="M14 214h368v18H14z"/><path d="M40 232v12M120 232v12M276 232v12M356 232v12"/>'
    '<path d="M52 176v38M149 180v34M196 96v118M340 96v118M196 96h20M320 96h20"/>',
    "sensor": '<rect x="338" y="46" width="16" height="16" rx="2"/><path d="M354 54q20 0 22 18"/>',
}  # fmt: skip


def picture(marked: Collection[str], hinted: Collection[str]) -> str:
    """SVG of the machine: parts where what was found acts, and parts that what remains only looks like."""
    drawn = []
    for part in PARTS:
        kind = "marked" if part in marked else "hinted" if part in hinted else "plain"
        x, y, label = _LABELS[part]
        drawn.append(
            f'<g class="{kind}"><g class="shape">{_SHAPES[part]}</g>'
            f'<text x="{x}" y="{y}" text-anchor="middle">{label}</text></g>'
        )
    told = [*(f"{part}: found here" for part in marked), *(f"{part}: what remains looks like it" for part in hinted)]
    title = "; ".join(told) or "no place is marked"
    return (
        f'<svg class="machine" viewBox="0 0 430 272" role="img" aria-label="The machine. {title}.">'
        '<path class="shaft" d="M82 152h36M180 152h42"/>'
        f"{''.join(drawn)}</svg>"
    )
