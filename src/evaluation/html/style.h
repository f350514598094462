// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace photoslam::html {

/// Style sheet of report.html: one column, quiet, light and dark, fit for print.
inline constexpr char kStyle[] = R"css(
:root { --paper: #fcfcfa; --ink: #1d1f21; --soft: #6c7075; --line: #e3e3de; --panel: #f4f4f0;
  --truth: #2f9e63; --estimate: #d2403a; --image: #3566b8; --time: #7a5aa8; }
@media (prefers-color-scheme: dark) {
  :root { --paper: #17181a; --ink: #e6e6e3; --soft: #94989d; --line: #303236; --panel: #1f2124;
    --truth: #4cc585; --estimate: #f0655d; --image: #7aa5ec; --time: #b497df; }
}
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink); -webkit-text-size-adjust: 100%;
  font: 15px/1.55 -apple-system, "Segoe UI", Inter, "Helvetica Neue", "DejaVu Sans", Arial, sans-serif;
  font-variant-numeric: tabular-nums; }
main { max-width: 1060px; margin: 0 auto; padding: 56px 28px 72px; }
.brand { font-size: 13px; letter-spacing: .14em; color: var(--soft); margin: 0 0 6px; }
h1 { font-size: 27px; line-height: 1.25; font-weight: 600; letter-spacing: -.01em; margin: 0; overflow-wrap: anywhere; }
h2 { font-size: 17px; font-weight: 600; margin: 56px 0 4px; }
p { margin: 0 0 14px; max-width: 68ch; }
.lead, .note, figcaption, footer { color: var(--soft); }
.lead { margin-top: 8px; }
.note, figcaption { font-size: 13px; max-width: none; }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(170px, 1fr)); margin: 36px 0 0;
  border-top: 1px solid var(--line); border-bottom: 1px solid var(--line); }
.tile { padding: 16px 16px 14px 0; }
.tile b { display: block; font-size: 30px; line-height: 1.2; font-weight: 500; letter-spacing: -.02em; }
.tile b small { font-size: 15px; font-weight: 400; color: var(--soft); margin-left: 4px; letter-spacing: 0; }
.tile span { font-size: 13px; color: var(--soft); }
figure { margin: 14px 0 0; }
svg { display: block; width: 100%; height: auto; }
svg.map { max-width: 720px; margin: 0 auto; }
.panel { background: var(--panel); border-radius: 6px; padding: 10px; }
.curve { fill: none; stroke-width: 1.4; stroke-linejoin: round; stroke-linecap: round; }
.truth { stroke: var(--truth); } .estimate { stroke: var(--estimate); } .image { stroke: var(--image); }
.time { stroke: var(--time); }
.map .truth { stroke-width: 4; opacity: .55; } .map .estimate { stroke-width: 1.5; }
.start { fill: var(--panel); stroke: var(--ink); stroke-width: 1.6; } .end { fill: var(--ink); }
.grid { stroke: var(--line); } .axis { stroke: var(--soft); } .bar { stroke: var(--ink); fill: none; }
.level { stroke: var(--soft); stroke-dasharray: 4 4; fill: none; } .mark { stroke: var(--estimate); stroke-width: 1.5; }
.tick { font-size: 12px; fill: var(--soft); }
.key { display: inline-block; width: 22px; height: 0; border-top: 3px solid; vertical-align: 4px; margin: 0 7px 0 16px; }
.key:first-child { margin-left: 0; }
.key.truth { border-color: var(--truth); } .key.estimate { border-color: var(--estimate); }
.pair { display: grid; grid-template-columns: 1fr 1fr; gap: 6px; }
.pair img { display: block; width: 100%; height: auto; border-radius: 3px; background: var(--panel); }
.pairs figure { margin: 18px 0 0; } .pairs figcaption { margin-top: 6px; }
.tables { columns: 3 280px; column-gap: 44px; margin-top: 14px; }
.tables table { break-inside: avoid; margin-bottom: 26px; }
table { border-collapse: collapse; width: 100%; font-size: 14px; }
caption { text-align: left; font-weight: 600; font-size: 14px; padding: 0 0 5px; }
td { padding: 5px 0; border-top: 1px solid var(--line); vertical-align: top; }
td:last-child { text-align: right; padding-left: 16px; overflow-wrap: anywhere; }
.absent { color: var(--soft); }
details { margin-top: 14px; } summary { cursor: pointer; font-size: 14px; color: var(--soft); }
details table { margin-top: 10px; font-family: ui-monospace, Menlo, "DejaVu Sans Mono", monospace; font-size: 12.5px; }
footer { margin-top: 64px; padding-top: 14px; border-top: 1px solid var(--line); font-size: 13px; }
@media print { main { padding: 0; } figure, table { break-inside: avoid; } }
)css";

}  // namespace photoslam::html
