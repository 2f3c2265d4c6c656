"use strict";
// The lines of the program, of which only those in sight are in the page, however many there are.
const LINE = 20;  // pixels, as in page.css
const SPARE = 10;  // lines above and below those in sight

class Lines {
  constructor(text, side, stops, go) {
    Object.assign(this, {text, side, frame: pick("#lines"), roll: pick("#roll"), current: 0, drawn: ""});
    this.faults = new Map();  // line -> the worst that is found there
    for (const [row, rank] of stops) {
      const line = side.line[row];
      this.faults.set(line, Math.min(rank, this.faults.get(line) ?? rank));
    }
    this.roll.style.height = `${LINE * text.length}px`;
    this.frame.addEventListener("scroll", () => this.draw());
    new ResizeObserver(() => { this.drawn = ""; this.follow(); }).observe(this.frame);
    this.roll.addEventListener("click", event => {
      const entry = event.target.closest(".line");
      if (entry) go(Number(entry.dataset.line));
    });
  }

  // The row at which the moves of a line begin, or of the next one that moves: after `row`, or else from the start.
  rowOf(line, row) {
    const {line: of, count} = this.side;
    let next = Infinity;
    for (let at = 0; at < count; at++) if (of[at] >= line && of[at] < next) next = of[at];
    const begins = at => of[at] === next && (at === 0 || of[at - 1] !== next);
    for (let k = 1; k <= count; k++) {
      const at = (Math.floor(row) + k) % count;
      if (begins(at)) return at;
    }
    return null;
  }

  // The line that moves before or after that of a row.
  beside(row, by) {
    const {line: of, count} = this.side, here = of[row];
    let at = row;
    while (at > 0 && at < count - 1 && of[at] === here) at += by;
    while (by < 0 && at > 0 && of[at - 1] === of[at]) at--;
    return at;
  }

  show(line) {
    if (line === this.current || line <= 0) return;
    this.current = line;
    this.follow();
  }

  // Bring the line that runs into the middle, unless it is in sight anyway.
  follow() {
    const {frame} = this, top = LINE * (this.current - 1), high = frame.clientHeight;
    if (top < frame.scrollTop + LINE || top > frame.scrollTop + high - 3 * LINE) frame.scrollTop = top - 0.4 * high;
    this.draw();
  }

  draw() {
    const {frame, text} = this, first = Math.max(Math.floor(frame.scrollTop / LINE) - SPARE, 0);
    const last = Math.min(first + Math.ceil(frame.clientHeight / LINE) + 2 * SPARE, text.length);
    const wanted = `${first} ${last} ${this.current}`;
    if (wanted === this.drawn) return;
    this.drawn = wanted;
    const entries = [];
    for (let at = first; at < last; at++) {
      const entry = document.createElement("div"), fault = this.faults.get(at + 1);
      entry.className = fault === undefined ? "line" : `line ${SEVERITIES[fault]}`;
      entry.dataset.line = at + 1;
      entry.textContent = text[at] || " ";
      if (at + 1 === this.current) entry.setAttribute("aria-current", "true");
      entries.push(entry);
    }
    this.roll.style.paddingTop = `${LINE * first}px`;
    this.roll.replaceChildren(...entries);
  }
}
