"use strict";
// Values under the pointer, and zoom along the path or the time, for the page's charts. They are drawn
// without this script too; it reads the points of their lines. Charts over the same quantity move together.
(() => {
  const UNIT = 0.01; // of a line's coordinates, points
  const LEAST = 1e-3; // share of the whole that a view shows at least
  const numbers = (text) => text.split(" ").map(Number);

  function make(parent, kind, attributes) {
    const node = document.createElementNS(parent.namespaceURI, kind);
    for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
    return parent.appendChild(node);
  }

  // Points of a line, in its own coordinates; a gap begins a new piece.
  function points(path) {
    const found = { x: [], y: [] };
    let x = 0, y = 0, from = "M";
    for (const piece of path.getAttribute("d").match(/[Ml][^Ml]*/g) || []) {
      from = piece[0];
      const values = piece.match(/-?\d+/g).map(Number);
      for (let i = 0; i < values.length; i += 2) {
        x = from === "M" ? values[i] : x + values[i];
        y = from === "M" ? values[i + 1] : y + values[i + 1];
        found.x.push(x);
        found.y.push(y);
      }
    }
    return found;
  }

  function ticks(low, high, most) {
    const power = 10 ** Math.floor(Math.log10(high - low));
    const step = [0.1, 0.2, 0.5, 1, 2, 5].map((s) => s * power).find((s) => (high - low) / s <= most);
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    const found = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k += 1) {
      const word = (k * step).toFixed(digits);
      found.push([k * step, (digits ? word : word.replace(/\B(?=(\d{3})+$)/g, "\u2009")).replace("-", "−")]);
    }
    return found;
  }

  class Panel {
    constructor(group, number) {
      const [left, top, width, height] = numbers(group.dataset.box);
      Object.assign(this, { group, left, top, width, height });
      [this.x, this.y] = [numbers(group.dataset.x), numbers(group.dataset.y)];
      const clip = make(group, "clipPath", { id: `panel-${number}` });
      make(clip, "rect", { x: left, y: top, width, height });
      const inner = make(group, "g", { "clip-path": `url(#panel-${number})` });
      this.lines = [...group.querySelectorAll("path[data-name]")];
      this.widths = this.lines.map((line) => UNIT * Number(line.getAttribute("stroke-width")));
      inner.append(...this.lines);
      this.grid = group.querySelector(".across");
      this.words = group.querySelector(".words");
      this.cursor = make(group, "path", { class: "cursor" });
      this.read = make(group, "text", { class: "read", "text-anchor": "end", x: left + width - 2, y: top + 8 });
    }

    show([low, high], scale) {
      const [first, last] = this.x;
      const zoom = (last - first) / (high - low);
      const shift = this.left - (this.left + ((low - first) / (last - first)) * this.width) * zoom;
      this.view = [low, high];
      this.lines.forEach((line, k) => {
        line.setAttribute("transform", `translate(${shift} 0) scale(${zoom * UNIT} ${UNIT})`);
        line.setAttribute("vector-effect", "non-scaling-stroke");
        line.setAttribute("stroke-width", this.widths[k] * scale);
      });
      const marks = ticks(low, high, 9).map(([value, word]) => [this.across(value), word]);
      this.grid.setAttribute("d", marks.map(([x]) => `M${x} ${this.top}v${this.height}`).join(""));
      if (this.words) {
        this.words.replaceChildren();
        for (const [x, word] of marks) {
          const y = this.top + this.height + 12;
          make(this.words, "text", { x, y, "text-anchor": "middle" }).textContent = word;
        }
      }
    }

    across(value) {
      return this.left + ((value - this.view[0]) / (this.view[1] - this.view[0])) * this.width;
    }

    // Values of the lines where one comes to, or is held up to, a place.
    values(at) {
      this.found ??= this.lines.map(points);
      const place = (this.left + ((at - this.x[0]) / (this.x[1] - this.x[0])) * this.width) / UNIT;
      return this.found.map(({ x, y }, k) => {
        let low = 0, high = x.length - 1;
        while (low < high) {
          const middle = (low + high) >> 1;
          if (x[middle] < place - 0.5) low = middle + 1;
          else high = middle;
        }
        const share = (this.top + this.height - y[low] * UNIT) / this.height;
        const value = this.y[0] + share * (this.y[1] - this.y[0]);
        const digits = Math.max(0, Math.min(6, 3 - Math.floor(Math.log10(this.y[1] - this.y[0]))));
        return [this.lines[k], value.toFixed(digits).replace("-", "−")];
      });
    }

    point(at) {
      const x = this.across(at);
      const inside = x >= this.left - 1e-6 && x <= this.left + this.width + 1e-6;
      this.cursor.setAttribute("d", inside ? `M${x} ${this.top}v${this.height}` : "");
      this.read.replaceChildren();
      if (!inside) return [];
      const values = this.values(at);
      values.forEach(([line, value], k) => {
        const look = { fill: line.getAttribute("stroke"), dx: k ? 8 : 0 };
        make(this.read, "tspan", look).textContent = `${line.dataset.name} ${value}`;
      });
      return values.map(([line, value]) => `${line.dataset.name} ${value}`);
    }
  }

  // All charts over one quantity, with one view and one cursor.
  class Group {
    constructor() {
      this.charts = [];
    }

    add(chart) {
      this.charts.push(chart);
      this.whole ??= chart.panels[0].x;
      this.at ??= (this.whole[0] + this.whole[1]) / 2;
    }

    show(low, high) {
      const [first, last] = this.whole;
      const width = Math.min(Math.max(high - low, LEAST * (last - first)), last - first);
      const from = Math.min(Math.max(low, first), last - width);
      this.view = [from, from + width];
      for (const { svg, panels } of this.charts) {
        const scale = svg.getBoundingClientRect().width / svg.viewBox.baseVal.width || 1;
        for (const panel of panels) panel.show(this.view, scale);
      }
    }

    // Point all charts at a place, and return what the lines of one say there.
    point(at, asked) {
      this.at = Math.min(Math.max(at, this.whole[0]), this.whole[1]);
      const said = [];
      for (const chart of this.charts) {
        for (const panel of chart.panels) {
          const values = panel.point(this.at).join(", ");
          if (chart === asked) said.push(`${panel.group.dataset.label}: ${values}`);
        }
      }
      return said;
    }
  }

  function listen(chart, group) {
    const { svg, panels, output } = chart;
    const [{ left, width }] = panels;
    let begin = null, band = null;
    const place = (event) => {
      const x = new DOMPoint(event.clientX, 0).matrixTransform(svg.getScreenCTM().inverse()).x;
      const share = Math.min(Math.max((x - left) / width, 0), 1);
      const [low, high] = group.view;
      return { x: left + share * width, at: low + share * (high - low) };
    };
    svg.addEventListener("pointerdown", (event) => {
      if (event.button) return;
      begin = place(event);
      svg.setPointerCapture(event.pointerId);
      const last = panels[panels.length - 1];
      const height = last.top + last.height - panels[0].top;
      band = make(svg, "rect", { class: "chosen", x: begin.x, y: panels[0].top, width: 0, height });
    });
    svg.addEventListener("pointermove", (event) => {
      const { x, at } = place(event);
      group.point(at);
      if (!band) return;
      band.setAttribute("x", Math.min(x, begin.x));
      band.setAttribute("width", Math.abs(x - begin.x));
    });
    const end = (event) => {
      if (!band) return;
      band.remove();
      band = null;
      const { x, at } = place(event);
      if (event.type === "pointerup" && Math.abs(x - begin.x) > 3) {
        group.show(Math.min(at, begin.at), Math.max(at, begin.at));
      }
      group.point(at);
    };
    svg.addEventListener("pointerup", end);
    svg.addEventListener("pointercancel", end);
    svg.addEventListener("dblclick", () => group.show(...group.whole));
    svg.addEventListener("keydown", (event) => {
      const [low, high] = group.view;
      const step = (high - low) / (event.shiftKey ? 10 : 100);
      const by = { ArrowLeft: -step, ArrowRight: step }[event.key] || 0;
      const zoom = { "+": 0.5, "-": 2 }[event.key] || 1;
      if (event.key === "Escape") group.show(...group.whole);
      else if (zoom !== 1) group.show(group.at - (group.at - low) * zoom, group.at + (high - group.at) * zoom);
      else if (!by) return;
      event.preventDefault();
      const at = group.at + by;
      if (at < group.view[0] || at > group.view[1]) group.show(group.view[0] + by, group.view[1] + by);
      const said = group.point(at, chart);
      output.textContent = `${chart.over} ${group.at.toFixed(1)}. ${said.join("; ")}`;
    });
  }

  const groups = {};
  let number = 0;
  for (const svg of document.querySelectorAll("svg[data-over]")) {
    const panels = [...svg.querySelectorAll(".panel")].map((group) => new Panel(group, (number += 1)));
    const output = document.createElement("output");
    output.className = "unseen";
    const hint = document.createElement("p");
    hint.className = "hint";
    hint.textContent = "Point at the lines for values; drag to zoom, double-click for the whole. " +
      "Keys: ← → move, + − zoom, Esc for the whole.";
    svg.after(hint, output);
    svg.classList.add("live");
    svg.setAttribute("tabindex", "0");
    const chart = { svg, panels, output, over: svg.dataset.over };
    (groups[chart.over] ??= new Group()).add(chart);
    listen(chart, groups[chart.over]);
  }
  const whole = () => Object.values(groups).forEach((group) => group.show(...(group.view || group.whole)));
  whole();
  addEventListener("resize", whole);
  document.body.dataset.ready = "yes";
})();
