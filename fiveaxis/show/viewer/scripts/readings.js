"use strict";
// The figures at the place shown. Texts are set as text, never as markup.
// As the control counts the axis, like the block beside it.
const shown = (axis, value) => axis.sign * value * (axis.rotary ? 180 / Math.PI : 1) + 0;  // no -0
const unitOf = axis => axis.rotary ? "°" : " mm";
const digits = (value, count) => value.toLocaleString("en", {minimumFractionDigits: count, maximumFractionDigits: count});

class Readings {
  constructor(head) {
    Object.assign(this, {head, axes: head.machine.axes});
    this.rows = this.axes.map((_, k) => pick(`tr[data-axis="${k}"]`));
    this.figures = Object.fromEntries(pickAll("tr[data-figure]").map(row => [row.dataset.figure, row]));
    const [low, high] = head.tilt;
    this.write(this.figures.lean.querySelector("th"), `lean, ${digits(low, 0)} … ${digits(high, 0)}°`);
  }

  show(stage, beside, stock) {
    const side = stage.side, row = stage.row, end = side.end(row), line = side.line[end];
    this.figures.removal.hidden = !stock;
    this.figures.lean.hidden = !side.isLeaned;
    if (stock) this.write(this.figures.removal.querySelector(".value"), `${digits(stock.removal, 1)} mm³/s`);
    const text = line > 0 ? `${line}: ${this.head.text[line - 1]}` : end > 0 ? `move ${end}` : "start";
    this.write(pick("#block"), text);
    this.column(side, row, "value");
    this.write(pick("#other-name"), beside ? beside.side.name : "");
    if (beside) this.column(beside.side, beside.row, "other");
    else for (const cell of pickAll("#readings td.other")) this.write(cell, "");
  }

  column(side, row, kind) {
    const values = side.values(row), end = side.end(row), k = this.axes.length;
    this.axes.forEach((axis, number) => {
      const value = shown(axis, values[number]), cells = this.rows[number];
      this.write(cells.querySelector(`.${kind}`), digits(value, 3) + unitOf(axis));
      if (kind !== "value") return;
      const meter = cells.querySelector("meter"), known = axis.low !== null && axis.high !== null;
      meter.hidden = !known;
      if (known) {
        const [low, high] = axis.sign > 0 ? [axis.low, axis.high] : [-axis.high, -axis.low];
        meter.value = (value - low) / (high - low);
        meter.title = `${digits(low, 0)} … ${digits(high, 0)}${unitOf(axis)}`;
      }
      this.write(cells.querySelector(".power"), axis.powered ? `${digits(side.powers[k * end + number], 0)} W` : "unknown");
    });
    const lean = side.at("lean", row);
    const figures = {
      time: `${digits(side.at("clock", row), 2)} s`,
      location: digits(side.at("place", row), 1),
      programmed: side.programmed[end] > 0 ? `${digits(side.programmed[end], 0)} mm/min` : "rapid or none",
      actual: side.actual[end] > 0 ? `${digits(side.actual[end], 0)} mm/min` : "–",
      lean: Number.isFinite(lean) ? `${digits(lean, 2)}°` : "–",
      power: this.axes.some(axis => axis.powered) ? `${digits(side.total[end], 0)} W` : "unknown",
    };
    for (const [name, text] of Object.entries(figures)) this.write(this.figures[name].querySelector(`.${kind}`), text);
  }

  write(cell, text) { if (cell.textContent !== text) cell.textContent = text; }
}
