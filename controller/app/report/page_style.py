"""Style sheet of the page: light, one column, readable on a laptop and on paper."""

from typing import Final

CSS: Final = """
:root { --ink: #22303c; --grey: #5d6c7a; --line: #e1e7ec; --blue: #0072b2; }
* { box-sizing: border-box; }
body { margin: 0; background: #f5f7f9; color: var(--ink);
  font: 15px/1.5 system-ui, "Segoe UI", Roboto, "DejaVu Sans", sans-serif; }
main { max-width: 1160px; margin: 0 auto; padding: 28px 20px 60px; }
h1 { font-size: 30px; line-height: 1.2; margin: 0 0 8px; }
h2 { font-size: 18px; margin: 0 0 10px; }
.kind { margin: 0; color: var(--grey); font-size: 13px; letter-spacing: .04em; }
.outcome { display: inline-block; margin: 0 0 10px; padding: 3px 12px; border-radius: 14px;
  font-weight: 600; }
.outcome.good { background: #d8f1e7; color: #00593f; }
.outcome.fair { background: #fcefcf; color: #6e4c00; }
.outcome.bad { background: #fbe0d2; color: #8c3a00; }
.verdict { margin: 0 0 10px; font-size: 16px; }
.note { margin: 0 0 10px; color: #8c3a00; }
.facts { margin: 0; color: var(--grey); font-size: 13px; }
.facts span { margin-right: 16px; white-space: nowrap; }
.facts b { font-weight: 600; color: var(--ink); }
.tiles { display: grid; gap: 10px; margin: 20px 0; padding: 0; background: none; border: 0;
  grid-template-columns: repeat(auto-fit, minmax(190px, 1fr)); }
.tiles div, section, details { background: #fff; border: 1px solid var(--line);
  border-radius: 8px; }
.tiles div { padding: 10px 14px; }
.tiles span { display: block; color: var(--grey); font-size: 13px; }
.tiles strong { display: block; font-size: 23px; line-height: 1.3; }
.tiles small { color: var(--grey); font-size: 13px; }
section { margin: 0 0 16px; padding: 16px 20px; }
figure { margin: 0; }
figure img, figure video { display: block; width: 100%; height: auto; }
figcaption { margin-top: 8px; color: var(--grey); font-size: 13px; }
table { border-collapse: collapse; width: 100%; font-size: 14px; }
td { padding: 4px 14px 4px 0; border-top: 1px solid var(--line); vertical-align: top; }
td:first-child { white-space: nowrap; font-variant-numeric: tabular-nums; }
tr:first-child td { border-top: 0; }
td:last-child { width: 100%; }
tr.warning td:nth-child(2) { color: #9a6a00; font-weight: 600; }
tr.error td:nth-child(2) { color: #b34700; font-weight: 600; }
details { margin: 0 0 10px; padding: 10px 20px; }
summary { cursor: pointer; font-weight: 600; }
pre { overflow-x: auto; font-size: 12.5px; }
@media print { body { background: #fff; } section { break-inside: avoid; } }
"""
