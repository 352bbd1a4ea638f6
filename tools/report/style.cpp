#include "tools/report/style.hpp"

namespace bmu::report {

// The inks are those of Okabe and Ito, brighter where the ground is dark.
const std::string_view page_style = R"css(
:root { color-scheme: light dark; --ground: #fff; --panel: #f6f7f9; --text: #1b1f24; --dim: #59636e; --grid: #e2e5e9;
  --frame: #c4cad1; --k0: #8a929b; --k1: #0072b2; --k2: #d55e00; --k3: #009e73; --k4: #a0508a; --k5: #b07d00; --bad: #b3261e; --warn: #9a6700; }
@media (prefers-color-scheme: dark) { :root { --ground: #14171b; --panel: #1e2329; --text: #e6e9ed; --dim: #9aa4af;
  --grid: #2b3138; --frame: #4a525b; --k0: #7d868f; --k1: #56b4e9; --k2: #ff8b45; --k3: #2ec79b; --k4: #e08fc8; --k5: #e8b93c; --bad: #ff8a80; --warn: #e8b93c; } }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 72rem; padding: 1.5rem 1rem 3rem; background: var(--ground); color: var(--text);
  font: 16px/1.5 system-ui, "Segoe UI", Roboto, "DejaVu Sans", sans-serif; overflow-wrap: anywhere; }
h1 { font-size: 1.7rem; line-height: 1.2; margin: 0 0 .3rem; }
h2 { font-size: 1.15rem; line-height: 1.3; margin: 0 0 .3rem; }
.unit { color: var(--dim); font-weight: normal; }
.lead, .nothing, .note { color: var(--dim); margin: 0 0 .4rem; }
section { margin: 1.7rem 0 0; }
.cards { display: grid; grid-template-columns: repeat(auto-fit, minmax(12.5rem, 1fr)); gap: .7rem; margin: 1.2rem 0 0; padding: 0; }
.cards div { background: var(--panel); border-radius: .5rem; padding: .6rem .8rem; }
.cards dt { color: var(--dim); font-size: .85rem; }
.cards dd { margin: 0; font-size: 1.15rem; font-variant-numeric: tabular-nums; }
.cards dd small { display: block; color: var(--dim); font-size: .85rem; }
.legend { list-style: none; display: flex; flex-wrap: wrap; gap: .1rem 1.1rem; margin: 0 0 .4rem; padding: 0; font-size: .85rem; color: var(--dim); }
.swatch { width: 24px; height: 12px; margin-right: .4rem; vertical-align: -1px; }
.plot { position: relative; margin: 0 0 0 3.4rem; height: 15rem; border: 1px solid var(--frame); }
.plot.low { height: 10rem; }
.plot svg, .bar svg { position: absolute; inset: 0; width: 100%; height: 100%; overflow: hidden; }
.y { position: absolute; right: 100%; margin-right: .4rem; transform: translateY(-50%); font-size: .8rem; color: var(--dim);
  font-variant-numeric: tabular-nums; white-space: nowrap; }
.times { position: relative; height: 1.4rem; margin-left: 3.4rem; font-size: .8rem; color: var(--dim); }
.x { position: absolute; top: .15rem; transform: translateX(-50%); white-space: nowrap; font-variant-numeric: tabular-nums; }
.line { fill: none; stroke-width: 1.6px; stroke-linejoin: round; stroke-linecap: round; vector-effect: non-scaling-stroke; }
.grid, .zero, .cursor { stroke: var(--grid); stroke-width: 1px; vector-effect: non-scaling-stroke; }
.zero, .cursor { stroke: var(--frame); }
.band { stroke: none; opacity: .2; }
.band.strong { opacity: .34; }
.k0.line { stroke: var(--k0); stroke-dasharray: 2 3; } .k0.band { fill: var(--k0); }
.k1.line { stroke: var(--k1); } .k1.band { fill: var(--k1); }
.k2.line { stroke: var(--k2); stroke-dasharray: 7 3; } .k2.band { fill: var(--k2); }
.k3.line { stroke: var(--k3); stroke-dasharray: 2 3; } .k3.band { fill: var(--k3); }
.k4.line { stroke: var(--k4); stroke-dasharray: 9 3 2 3; } .k4.band { fill: var(--k4); }
.k5.line { stroke: var(--k5); stroke-dasharray: 12 4; } .k5.band { fill: var(--k5); }
.dot { stroke: var(--k1); stroke-width: 5px; stroke-linecap: round; vector-effect: non-scaling-stroke; }
.doubt { stroke: var(--k1); stroke-width: 1px; opacity: .6; vector-effect: non-scaling-stroke; }
.amount { fill: var(--k3); }
.hole { fill: var(--k0); opacity: .28; }
.row { margin: .5rem 0 0 3.4rem; font-size: .85rem; }
.bar { position: relative; height: 1.1rem; background: var(--panel); }
.c0 { fill: var(--k0); } .c1 { fill: var(--k1); } .c2 { fill: var(--k2); } .c3 { fill: var(--k3); } .c4 { fill: var(--k4); } .c5 { fill: var(--k5); }
.pair { display: inline-block; margin-right: .9rem; }
.share { display: inline-block; width: .8rem; height: .8rem; margin-right: .35rem; border-radius: 2px; vertical-align: -1px; }
.share.c0 { background: var(--k0); } .share.c1 { background: var(--k1); } .share.c2 { background: var(--k2); }
.share.c3 { background: var(--k3); } .share.c4 { background: var(--k4); } .share.c5 { background: var(--k5); }
.vague { opacity: .45; }
.fault { fill: var(--bad); } .warning { fill: var(--warn); }
b.fault { color: var(--bad); } b.warning { color: var(--warn); }
table { border-collapse: collapse; font-size: .85rem; font-variant-numeric: tabular-nums; width: 100%; }
th, td { text-align: left; padding: .15rem .6rem .15rem 0; border-bottom: 1px solid var(--grid); vertical-align: top; }
th { color: var(--dim); font-weight: normal; }
.events td:first-child, .holes td:nth-child(-n+3) { white-space: nowrap; }
.holes td:last-child { min-width: 14rem; }
td.n, th.n { text-align: right; }
.scroll { overflow-x: auto; }
.read { min-height: 1.3rem; margin: 0 0 0 3.4rem; font-size: .8rem; color: var(--dim); font-variant-numeric: tabular-nums; }
summary { cursor: pointer; color: var(--dim); }
footer { margin-top: 3rem; color: var(--dim); font-size: .85rem; }
@media (max-width: 40rem) { body { padding: 1rem .7rem 2rem; } h1 { font-size: 1.35rem; } .x.wide { display: none; }
  .plot, .times, .row, .read { margin-left: 2.9rem; } .plot { height: 13rem; } .cards { grid-template-columns: 1fr 1fr; gap: .5rem; }
  .cards dd { font-size: 1rem; } }
@media print { :root { --ground: #fff; --panel: #f3f4f6; --text: #000; --dim: #444; --grid: #ddd; --frame: #999; --k0: #777; --k1: #0072b2;
  --k2: #d55e00; --k3: #00845f; --k4: #a0508a; --k5: #8f6500; --bad: #b3261e; --warn: #805500; color-scheme: light; }
  body { font-size: 10.5pt; max-width: none; padding: 0; -webkit-print-color-adjust: exact; print-color-adjust: exact; }
  section { break-inside: avoid; margin-top: 1.3rem; } section.long { break-inside: auto; } tr { break-inside: avoid; }
  .plot { height: 11rem; } .read { display: none; } }
)css";

const std::string_view page_script = R"js(
(function () {
  window.addEventListener('beforeprint', function () { document.querySelectorAll('details').forEach(function (d) { d.open = true; }); });
  var root = document.documentElement, from = +root.dataset.from, to = +root.dataset.to;
  function value(line, x) {
    var list = line.pts || (line.pts = line.getAttribute('points').trim().split(' ').map(function (p) { return p.split(',').map(Number); }));
    if (x < list[0][0] - 4 || x > list[list.length - 1][0] + 4) return null;
    var best = list[0];
    list.forEach(function (p) { if (Math.abs(p[0] - x) < Math.abs(best[0] - x)) best = p; });
    return best[1];
  }
  document.querySelectorAll('.plot[data-low]').forEach(function (plot) {
    var low = +plot.dataset.low, high = +plot.dataset.high, read = plot.parentNode.querySelector('.read'), svg = plot.querySelector('svg');
    var cursor = document.createElementNS('http://www.w3.org/2000/svg', 'line');
    cursor.setAttribute('class', 'cursor'); cursor.setAttribute('y1', 0); cursor.setAttribute('y2', 1000);
    plot.addEventListener('pointermove', function (event) {
      var box = plot.getBoundingClientRect(), x = (event.clientX - box.left) / box.width * 1000;
      var text = new Date(from + (to - from) * x / 1000).toISOString().replace('T', ' ').slice(0, 23) + ' UTC', seen = {};
      plot.querySelectorAll('polyline').forEach(function (line) {
        var y = value(line, x), name = line.dataset.name;
        if (y === null || seen[name]) return;
        seen[name] = true;
        text += '   ' + name + ': ' + (high - y / 1000 * (high - low)).toFixed(+plot.dataset.decimals) + ' ' + line.dataset.unit;
      });
      read.textContent = text;
      cursor.setAttribute('x1', x); cursor.setAttribute('x2', x); svg.appendChild(cursor);
    });
    plot.addEventListener('pointerleave', function () { read.textContent = ''; if (cursor.parentNode) svg.removeChild(cursor); });
  });
})();
)js";

}  // namespace bmu::report
