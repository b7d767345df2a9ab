// Draws the page's figures again as plots that can be zoomed, and saves their numbers.
"use strict";
(() => {
  const charts = JSON.parse(document.getElementById("charts").textContent);
  const plots = {};
  const HEIGHT = 172;
  const colour = (name) => () => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const SUPERSCRIPTS = "⁰¹²³⁴⁵⁶⁷⁸⁹";
  const raised = (power) => (power < 0 ? "⁻" : "") + [...String(Math.abs(power))].map((digit) => SUPERSCRIPTS[digit]).join("");

  // A number on an axis, as the drawings have it.
  function number(value) {
    if (value === null || value === undefined) return "";
    const power = value === 0 ? 0 : Math.floor(Math.log10(Math.abs(value)) + 1e-9);
    if (power >= -3 && power <= 4) return String(Number(value.toPrecision(6))).replace("-", "−");
    const mantissa = Number((value / 10 ** power).toPrecision(4));
    return ((mantissa === 1 ? "" : mantissa + " × ") + "10" + raised(power)).replace("-", "−");
  }

  // On a logarithmic axis only powers of ten have room; within one, 1, 2 and 5 of it; within these, every tick.
  function powers(_plot, ticks) {
    const leads = (firsts) => (value) => firsts.some((first) => {
      const power = Math.log10(value / first);
      return Math.abs(power - Math.round(power)) < 1e-9;
    });
    const shown = [leads([1]), leads([1, 2, 5])].find((has) => ticks.filter(has).length >= 2) || (() => true);
    return ticks.map((value) => (shown(value) ? value : null));
  }

  function axis(label, log, size) {
    const ink = colour("--ink");
    const grid = { stroke: colour("--rule"), width: 1, ...(log ? { filter: powers } : {}) };
    return {
      label, size, stroke: ink, grid, labelSize: 18, gap: 4, font: "12px system-ui, sans-serif",
      labelFont: "12px system-ui, sans-serif", ticks: { ...grid, size: 4 },
      ...(log ? { filter: powers } : {}), values: (_plot, ticks) => ticks.map(number),
    };
  }

  function stretches(plot, of) {
    const { left, top, width, height } = plot.bbox;
    plot.ctx.save();
    plot.ctx.fillStyle = colour("--held")();
    for (const [begin, end] of of) {
      const from = Math.max(plot.valToPos(begin, "x", true), left);
      const to = Math.min(plot.valToPos(end, "x", true), left + width);
      if (to > from) plot.ctx.fillRect(from, top, to - from, height);
    }
    plot.ctx.restore();
  }

  const of = (group) => charts.filter((chart) => chart.group === group).map((chart) => plots[chart.id]).filter(Boolean);

  // Shows the same stretch of x in all plots of a group.
  let moving = false;
  function show(group, min, max) {
    if (moving || !(max > min)) return;
    moving = true;
    for (const plot of of(group)) plot.setScale("x", { min, max });
    moving = false;
  }

  // Widens or narrows by `factor` about the middle and moves by `share` of the width, on the axis's own scale.
  function change(group, factor, share) {
    const plot = of(group)[0];
    const log = plot.scales.x.distr === 3;
    const [to, from] = log ? [Math.log10, (value) => 10 ** value] : [Number, Number];
    const { min, max } = plot.scales.x;
    const half = (to(max) - to(min)) / 2;
    const middle = (to(max) + to(min)) / 2 + 2 * share * half;
    show(group, from(middle - factor * half), from(middle + factor * half));
  }

  function whole(group) {
    const x = of(group).map((plot) => plot.data[0]);
    show(group, Math.min(...x.map((one) => one[0])), Math.max(...x.map((one) => one[one.length - 1])));
  }

  // Writes the values under the cursor, each in the colour of its line.
  function read(output, chart, row) {
    if (row === null || row === undefined) { output.textContent = ""; return; }
    const values = chart.lines.map((line, place) => {
      const value = document.createElement("b");
      value.textContent = number(chart.data[place + 1][row]) || "–";
      value.style.color = `var(${line.ink})`;
      return value;
    });
    output.replaceChildren(number(chart.data[0][row]), ": ", ...values.flatMap((value, place) => (place ? [", ", value] : [value])));
  }

  function draw(figure, chart) {
    const log = chart.log;
    const [low, high] = [chart.data[0][0], chart.data[0].at(-1)];
    const options = {
      width: figure.clientWidth, height: HEIGHT,
      padding: [8, 10, 0, 0],
      scales: { x: { time: false, distr: log ? 3 : 1, range: (_plot, min, max) => [min ?? low, max ?? high] }, y: { distr: log ? 3 : 1 } },
      series: [
        {},
        ...chart.lines.map((line) => ({
          label: line.name, stroke: colour(line.ink), width: line.dashed ? 1.5 : 1.25, spanGaps: log,
          dash: line.dashed ? [6, 4] : undefined, points: { show: false },
        })),
      ],
      bands: chart.envelope ? [{ series: [2, 1], fill: colour(chart.lines[0].ink) }] : undefined,
      axes: [axis(chart.x, log, 28), axis(chart.y, log, (plot, values) => Math.max(52, 14 + 7 * Math.max(0, ...(values || []).map((one) => String(one ?? "").length))))],
      legend: { show: false },
      cursor: {
        sync: { key: chart.group, setSeries: false },
        drag: { x: true, y: false, dist: 4 },
        bind: {
          // With the shift key a drag moves the plot instead.
          mousedown: (_plot, _target, handler) => (event) => { if (!event.shiftKey) handler(event); },
          dblclick: () => () => { whole(chart.group); },
        },
      },
      hooks: {
        drawClear: [(plot) => stretches(plot, chart.stretches)],
        setCursor: [(plot) => read(figure.querySelector("output"), chart, plot.cursor.idx)],
        setScale: [(plot, key) => { if (key === "x") show(chart.group, plot.scales.x.min, plot.scales.x.max); }],
      },
    };
    const place = document.createElement("div");
    place.className = "live";
    figure.append(place);
    moving = true;
    const plot = (plots[chart.id] = new uPlot(options, chart.data, place));
    moving = false;
    let last = null;
    plot.over.addEventListener("pointerdown", (event) => { if (event.shiftKey) { last = event.clientX; plot.over.setPointerCapture(event.pointerId); } });
    plot.over.addEventListener("pointermove", (event) => {
      if (last === null) return;
      change(chart.group, 1, (last - event.clientX) / plot.over.clientWidth);
      last = event.clientX;
    });
    plot.over.addEventListener("pointerup", () => { last = null; });
  }

  function csv(chart) {
    const quoted = (text) => (/[",]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
    const columns = chart.columns ?? [chart.x, ...chart.lines.map((line) => `${line.name}: ${chart.y}`)];
    const head = columns.map(quoted).join(",");
    const rows = chart.data[0].map((_x, row) => chart.data.map((column) => column[row] ?? "").join(","));
    return [head, ...rows].join("\n") + "\n";
  }

  function save(chart) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([csv(chart)], { type: "text/csv" }));
    link.download = `${chart.id}.csv`;
    link.click();
    URL.revokeObjectURL(link.href);
  }

  function button(words, title, action) {
    const made = document.createElement("button");
    made.type = "button";
    made.textContent = words;
    made.title = title;
    made.addEventListener("click", action);
    return made;
  }

  document.documentElement.classList.add("scripted");
  for (const chart of charts) {
    const figure = document.querySelector(`figure[data-chart="${chart.id}"]`);
    if (chart.lines) draw(figure, chart);
    figure.querySelector("button.csv").addEventListener("click", () => save(chart));
  }
  for (const tools of document.querySelectorAll(".tools")) {
    const group = tools.dataset.group;
    tools.append(
      button("−", "Show more", () => change(group, 2, 0)), button("+", "Show less, larger", () => change(group, 0.5, 0)),
      button("◂", "Earlier, lower", () => change(group, 1, -0.25)), button("▸", "Later, higher", () => change(group, 1, 0.25)),
      button("whole", "Show everything (double click)", () => whole(group)),
    );
  }
  const fit = () => {
    for (const plot of Object.values(plots)) plot.setSize({ width: plot.root.parentNode.clientWidth, height: HEIGHT });
  };
  new ResizeObserver(fit).observe(document.querySelector("main"));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { for (const plot of Object.values(plots)) plot.redraw(); });
})();
