"use strict";
// Unpacks the scene: meshcat's commands, and the moves as typed arrays.
const pick = selector => document.querySelector(selector);
const pickAll = selector => [...document.querySelectorAll(selector)];
const KINDS = {f8: Float64Array, f4: Float32Array, i4: Int32Array, u2: Uint16Array, u1: Uint8Array};

async function unpack(text) {
  // The browser's own decoder of data URLs is the quickest.
  const packed = await fetch(`data:application/gzip;base64,${text.trim()}`);
  const stream = packed.body.pipeThrough(new DecompressionStream("gzip"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const length = new DataView(bytes.buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + length)));
  let start = 4 + length;
  const commands = head.commands.map(size => bytes.subarray(start, start += size));
  const arrays = {};
  for (const [name, {kind, size, unit}] of Object.entries(head.sections)) {
    const found = new KINDS[kind](bytes.slice(start, start += size).buffer);
    arrays[name] = unit === undefined ? found : scaled(found, unit);
  }
  return {head, commands, arrays};
}

function scaled(steps, unit) {
  const values = new Float32Array(steps);
  for (let at = 0; at < values.length; at++) values[at] *= unit;
  return values;
}

// The last index whose entry isn't above a value, in ascending numbers.
function lastUpTo(numbers, value) {
  let low = 0, high = numbers.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (numbers[middle] <= value) low = middle; else high = middle - 1;
  }
  return low;
}

// One motion: rows with their time, place on the path and axis values. A row may be a fraction: 3.25 is a
// quarter of the move to row 4.
class Side {
  constructor(name, number, arrays, axes) {
    const own = what => arrays[`${number}/${what}`];
    Object.assign(this, {name, number, axes, count: own("clock").length});
    for (const what of ["clock", "positions", "place", "points", "lean", "line", "tool", "cutting", "powers", "programmed", "actual", "events"])
      this[what] = own(what);
    this.duration = this.clock[this.count - 1];
    this.isLeaned = this.lean.some(Number.isFinite);
    this.total = Float32Array.from({length: this.count}, (_, row) => {
      let sum = 0;
      for (let k = 0; k < axes; k++) sum += this.powers[axes * row + k];
      return sum;
    });
  }

  // The row at a time, or at a place of the path; the first of several at the same one.
  rowAt(value, of = this.clock) {
    const before = lastUpTo(of, value);
    if (before === this.count - 1) return before;
    const step = of[before + 1] - of[before];
    return before + (step > 0 ? Math.min(Math.max((value - of[before]) / step, 0), 1) : 0);
  }

  // The row at which the move ends that a fractional row is in.
  end(row) { return Math.ceil(row - 1e-9); }

  at(what, row) {
    const before = Math.floor(row), next = Math.min(before + 1, this.count - 1), share = row - before;
    return this[what][before] + share * (this[what][next] - this[what][before]);
  }

  values(row) {
    const before = Math.floor(row), next = Math.min(before + 1, this.count - 1), share = row - before, k = this.axes;
    return Array.from({length: k}, (_, axis) => {
      const begin = this.positions[k * before + axis];
      return begin + share * (this.positions[k * next + axis] - begin);
    });
  }
}
