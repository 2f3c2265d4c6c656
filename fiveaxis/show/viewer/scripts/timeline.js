"use strict";
// Power, feed, removal rate of a stock and findings over time, and below them a row for each axis with its starts and reversals. They are
// drawn once a size and baseline, the cursor moves above them.
const POWER_COLOUR = "#e8c468", ACTUAL_COLOUR = "#6cb8ff", PROGRAMMED_COLOUR = "#8a919c", REMOVAL_COLOUR = "#b48cff";
const FINDING_COLOURS = {error: "#ff4d5e", warning: "#ffb224", note: "#6cb8ff"};
// A start, a reversal.
const EVENT_COLOURS = ["#4fd1b5", "#ff7ad9"], BASELINE_COLOUR = "#2c3038";
const ROW = 12;  // pixels, of an axis

class Timeline {
  constructor(side, marks, seek, stock) {
    Object.assign(this, {side, marks, stock, beside: null, frame: pick("#timeline"), canvas: pick("#curves"), cursor: pick("#cursor")});
    const goTo = event => {
      const box = this.frame.getBoundingClientRect();
      seek(this.side.duration * Math.min(Math.max((event.clientX - box.left) / box.width, 0), 1));
    };
    this.frame.addEventListener("pointerdown", event => { this.frame.setPointerCapture(event.pointerId); goTo(event); });
    this.frame.addEventListener("pointermove", event => { if (event.buttons & 1) goTo(event); });
    new ResizeObserver(() => this.draw()).observe(this.frame);
  }

  // The highest value of each pixel's moves, which end at clock: no peak is lost, however many there are.
  peaks(values, clock, width) {
    const found = new Float32Array(width), {duration} = this.side;
    for (let row = 1; row < clock.length; row++) {
      const first = Math.min(Math.floor(clock[row - 1] / duration * width), width - 1);
      const last = Math.min(Math.floor(clock[row] / duration * width), width - 1);
      for (let x = first; x <= last; x++) if (values[row] > found[x]) found[x] = values[row];
    }
    return found;
  }

  draw() {
    const ratio = window.devicePixelRatio || 1, box = this.frame.getBoundingClientRect();
    const width = this.canvas.width = Math.max(1, Math.round(box.width * ratio));
    const whole = this.canvas.height = Math.max(1, Math.round(box.height * ratio));
    const height = whole - ROW * ratio * this.side.axes;
    const pen = this.canvas.getContext("2d");
    const curve = (values, colour, filled, top, clock = this.side.clock) => {
      const peaks = this.peaks(values, clock, width);
      pen.beginPath();
      pen.moveTo(0, height);
      peaks.forEach((value, x) => pen.lineTo(x + 0.5, height * (1 - 0.92 * value / top)));
      pen.lineTo(width, height);
      pen[filled ? "fillStyle" : "strokeStyle"] = colour;
      pen.lineWidth = ratio;
      if (filled) pen.fill(); else pen.stroke();
    };
    const largest = values => values.reduce((most, value) => Math.max(most, value), 1e-9);
    const feed = Math.max(largest(this.side.programmed), largest(this.side.actual));
    curve(this.side.total, POWER_COLOUR, true, largest(this.side.total));
    curve(this.side.programmed, PROGRAMMED_COLOUR, false, feed);
    curve(this.side.actual, ACTUAL_COLOUR, false, feed);
    if (this.stock) curve(this.stock.rate, REMOVAL_COLOUR, false, largest(this.stock.rate), this.stock.clock);
    for (const {row, severity} of this.marks) {
      pen.fillStyle = FINDING_COLOURS[severity];
      pen.fillRect(this.side.clock[row] / this.side.duration * width - ratio, 0, 2 * ratio, height / 4);
    }
    this.events(pen, this.side, time => time, height, this.beside ? ROW / 2 : ROW - 1);
    if (!this.beside) return;
    const below = height + ROW / 2 * ratio;
    pen.fillStyle = BASELINE_COLOUR;
    for (let axis = 0; axis < this.side.axes; axis++) pen.fillRect(0, below + ROW * ratio * axis, width, (ROW / 2 - 1) * ratio);
    this.events(pen, this.beside, time => this.atSamePlace(time), below, ROW / 2 - 1);
  }

  // When the result is at the place of the path where the baseline is at a time.
  atSamePlace(time) {
    const place = this.beside.at("place", this.beside.rowAt(time));
    return this.side.at("clock", this.side.rowAt(place, this.side.place));
  }

  // One mark a pixel for each axis, a reversal above a start.
  events(pen, side, timeOf, top, high) {
    const ratio = window.devicePixelRatio || 1, last = this.canvas.width - 1;
    for (const kind of [0, 1]) {
      pen.fillStyle = EVENT_COLOURS[kind];
      const drawn = new Set();
      for (let at = 0; at < side.events.length; at += 3) {
        const [time, axis, reverses] = side.events.subarray(at, at + 3);
        const x = Math.min(Math.round(timeOf(time) / this.side.duration * last / ratio), Math.floor(last / ratio));
        if (reverses !== kind || drawn.has(axis + side.axes * x)) continue;
        drawn.add(axis + side.axes * x);
        pen.fillRect(x * ratio, top + ROW * ratio * axis, ratio, high * ratio);
      }
    }
  }

  point(time) { this.cursor.style.left = `${100 * time / this.side.duration}%`; }
}
