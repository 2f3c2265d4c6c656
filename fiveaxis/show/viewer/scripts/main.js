"use strict";
// Connects the page's controls to the scene.
const report = text => { const line = pick("#fault"); line.textContent = text; line.hidden = false; };
const SHOWN_SIZE = 2.4;  // of what is in view, for which the viewer's lights and clipping are made
const APART = 1.1;  // side by side: distance of the two in sizes of the scene
const RIGHT = [Math.SQRT1_2, Math.SQRT1_2, 0];  // across the view
const STEP = 10;  // s, of Page Up and Page Down
const MOST_MOVED = 1.6;  // sizes of part and tool that both take in the machine's frame
const NEAR = 14;  // pixels, from a click to the path
const SEVERITIES = ["error", "warning"];
// Width of a window, pixels -> the panels that are open in it at first.
const PANELS = [[1200, ["legend", "readings", "program"]], [761, ["readings", "program"]], [0, []]];

class Show {
  constructor(viewer, head, arrays) {
    // A row of its own, as several may be at one time.
    Object.assign(this, {viewer, head, time: 0, row: 0, playing: false, speed: 1});
    this.chain = new Chain(head.machine);
    this.sides = head.sides.map((name, number) => new Side(name, number, arrays, head.machine.axes.length));
    this.result = this.sides[0];
    const group = viewer.scene_tree.find(head.stage.split("/").filter(name => name)).object;
    this.root = group.parent;
    this.root.matrixAutoUpdate = false;
    this.stock = head.stock && new CutStock(head.stock, arrays);
    if (this.stock) child(group, "workpiece").add(this.stock.mesh);
    // Meshes are shared with the copy.
    this.twin = new Stage(group.clone(true), this.chain);
    this.root.add(this.twin.group);
    this.stage = new Stage(group, this.chain);
    this.stage.follow(this.result, head);
    this.readings = new Readings(head);
    this.stops = head.stops;  // row, rank of the severity, text; by row
    const marks = this.stops.map(([row, rank]) => ({row, severity: SEVERITIES[rank]}));
    this.timeline = new Timeline(this.result, marks, time => this.seek(time), this.stock);
    if (head.text.length)
      this.lines = new Lines(head.text, this.result, this.stops, line => this.seekRow(this.lines.rowOf(line, this.row)));
    this.views = new Views(viewer, pick("#meshcat-pane"));
  }

  get beside() {
    const chosen = pick("#beside");
    return chosen && chosen.value ? this.sides[Number(chosen.value)] : null;
  }

  // What is in view, how large, and where each motion stands in it.
  arrange() {
    const inMachine = pick('input[name="frame"]:checked').value === "machine";
    const {middle, size} = this.head.extents[!inMachine ? "part" : pick("#whole").checked ? "machine" : "work"];
    const beside = this.beside, aside = 0.5 * APART * size;
    const scale = SHOWN_SIZE / size / (beside ? 1.6 : 1);
    this.root.matrix.makeScale(scale, scale, scale).setPosition(...middle.map(part => -part * scale));
    this.inMachine = inMachine;
    this.apart = beside ? RIGHT.map(way => way * aside) : null;
    this.twin.group.visible = beside !== null;
    pick("#side").classList.toggle("beside", beside !== null);
    if (beside) this.twin.follow(beside, this.head);
    if (beside !== this.timeline.beside) {
      this.timeline.beside = beside;
      this.timeline.draw();
    }
    for (const box of pickAll("[data-node]"))
      for (const stage of [this.stage, this.twin]) {
        const node = child(stage.group, box.dataset.node);
        if (node) node.visible = box.checked;
      }
    if (this.stock) this.stock.colour(pick("#map") !== null && pick("#map").checked);
    this.draw();
  }

  draw() {
    const {row, beside} = this;
    this.stage.show(row, this.inMachine, this.apart);
    if (this.stock) this.stock.show(this.time);
    // Both are at the same place of the path, so that their postures there can be compared.
    if (beside)
      this.twin.show(beside.rowAt(this.result.at("place", row), beside.place), this.inMachine, this.apart.map(way => -way));
    this.root.updateMatrixWorld(true);
    this.readings.show(this.stage, beside ? this.twin : null, this.stock);
    this.timeline.point(this.time);
    pick("#time").value = this.time;
    pick("#clock").textContent = `${this.time.toFixed(1)} of ${this.result.duration.toFixed(1)} s`;
    pick("#play").textContent = this.playing ? "pause" : "play";
    if (this.lines) this.lines.show(this.result.line[this.result.end(row)]);
    const here = this.stops.filter(([at]) => at === row);
    pick("#found").hidden = !here.length;
    pick("#found").textContent = here.map(([, , text]) => text).join("; ");
    this.viewer.set_dirty();
  }

  // To the next or previous place of the program where something is found.
  toFinding(by) {
    const beyond = ([row]) => by * (row - this.row) > 0;
    const stop = by > 0 ? this.stops.find(beyond) : this.stops.findLast(beyond);
    if (stop) this.seekRow(stop[0]);
  }

  // The first row after one, up to a time, at which the program is to stop for what is found.
  stopOf(after, until) {
    const {clock} = this.result, worst = Number(pick("#stop-at").value);
    const stop = this.stops.find(([row, rank]) => rank <= worst && row > after && clock[row] <= until);
    return stop && stop[0];
  }

  // At a time, or in a row of that time.
  go(time, row) {
    this.time = Math.min(Math.max(time, 0), this.result.duration);
    this.row = row ?? this.result.rowAt(this.time);
  }

  seek(time, row) {
    this.go(time, row);
    this.playing = false;
    this.draw();
  }

  seekRow(row) {
    const at = Math.min(Math.max(row, 0), this.result.count - 1);
    this.seek(this.result.clock[at], at);
  }

  step(by) { this.seekRow(by > 0 ? Math.floor(this.row + 1e-9) + by : Math.ceil(this.row - 1e-9) + by); }

  toLine(by) {
    if (this.lines) this.seekRow(this.lines.beside(this.result.end(this.row), by));
  }

  play(on) {
    if (on && this.time >= this.result.duration) this.go(0, 0);
    this.playing = on;
    let last = null;
    const follow = now => {
      if (!this.playing) return;
      if (last !== null) {
        const to = Math.min(this.time + this.speed * (now - last) / 1000, this.result.duration);
        const stop = this.stopOf(this.row, to);
        this.go(stop === undefined ? to : this.result.clock[stop], stop);
        this.playing = stop === undefined;
      }
      last = now;
      if (this.time >= this.result.duration) this.playing = false;
      this.draw();
      requestAnimationFrame(follow);
    };
    if (on) requestAnimationFrame(follow);
    this.draw();
  }

  click(x, y) {
    const box = pick("#meshcat-pane canvas").getBoundingClientRect();
    const found = this.stage.nearest(this.viewer.camera, x - box.left, y - box.top, box.width, box.height);
    if (found.off <= NEAR) this.seekRow(found.row);
  }

  operate() {
    for (const input of pickAll('#legend input, #beside')) input.addEventListener("change", () => this.arrange());
    pick("#play").addEventListener("click", () => this.play(!this.playing));
    const slider = pick("#time");
    slider.max = this.result.duration;
    slider.addEventListener("input", () => this.seek(Number(slider.value)));
    const speed = pick("#speed");
    speed.addEventListener("change", () => { this.speed = Number(speed.value); });
    // A long program takes about a minute at first.
    const offered = [...speed.options].map(option => Number(option.value));
    this.speed = offered.find(one => one >= this.result.duration / 60 && one >= 1) || offered.at(-1);
    speed.value = String(this.speed);
    for (const entry of pickAll("[data-row]"))
      entry.addEventListener("click", () => this.seekRow(Number(entry.dataset.row)));
    let pressed = null;
    const pane = pick("#meshcat-pane");
    pane.addEventListener("pointerdown", event => { pressed = [event.clientX, event.clientY]; });
    pane.addEventListener("pointerup", event => {
      const still = pressed && Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) < 4;
      if (still) this.click(event.clientX, event.clientY);
    });
    document.addEventListener("keydown", event => this.key(event));
    for (const one of pickAll("[data-view]")) one.addEventListener("click", () => this.views.look(one.dataset.view));
    pick("#stops").hidden = !this.stops.length;
    pick("#next").addEventListener("click", () => this.toFinding(1));
    pick("#previous").addEventListener("click", () => this.toFinding(-1));
    this.openPanels();
  }

  openPanels() {
    const [, open] = PANELS.find(([width]) => window.innerWidth >= width);
    const buttons = pickAll("[data-panel]");
    const set = (button, on) => {
      pick(`#${button.dataset.panel}`).hidden = !on;
      button.setAttribute("aria-expanded", on);
    };
    for (const button of buttons) {
      const there = button.dataset.panel !== "program" || this.lines !== undefined;
      button.hidden = !there;
      set(button, there && open.includes(button.dataset.panel));
      button.addEventListener("click", () => {
        const on = button.getAttribute("aria-expanded") !== "true";
        // In a narrow window one panel at a time leaves room for the scene.
        if (on && window.innerWidth < PANELS[1][0]) for (const other of buttons) set(other, false);
        set(button, on);
      });
    }
  }

  key(event) {
    if (event.target.matches("select, input[type=range], button") || event.ctrlKey || event.metaKey || event.altKey) return;
    const frames = pickAll('input[name="frame"]');
    const actions = {
      " ": () => this.play(!this.playing),
      ArrowRight: () => this.step(1),
      ArrowLeft: () => this.step(-1),
      PageDown: () => this.seek(this.time + STEP),
      PageUp: () => this.seek(this.time - STEP),
      Home: () => this.seekRow(0),
      End: () => this.seekRow(this.result.count - 1),
      ArrowUp: () => this.toLine(-1),
      ArrowDown: () => this.toLine(1),
      n: () => this.toFinding(1),
      p: () => this.toFinding(-1),
      0: () => this.views.look("iso"),
      1: () => this.views.look("front"),
      2: () => this.views.look("top"),
      3: () => this.views.look("right"),
      f: () => this.views.look("fit"),
      m: () => { frames.find(one => !one.checked).checked = true; this.arrange(); },
    };
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (action) { event.preventDefault(); action(); }
  }
}

let viewer = null, show = null;
async function start() {
  viewer = new MeshCat.Viewer(pick("#meshcat-pane"));
  const {head, commands, arrays} = await unpack(pick("#scene").textContent);
  pick("#scene").remove();
  for (const command of commands) viewer.handle_command_bytearray(command);
  show = new Show(viewer, head, arrays);
  show.operate();
  // Where the table carries the part far, only in the part's frame both fill the window.
  if (head.extents.work.size > MOST_MOVED * head.extents.part.size) pick("input[value=part]").checked = true;
  show.arrange();
  show.views.resize();
  show.views.look("iso");
  show.play(show.stopOf(-1, 0) === undefined);
  performance.mark("ready");
  document.body.dataset.ready = "yes";
}
start().catch(fault => {
  report(`The scene can't be shown: ${fault.message}. It needs WebGL and a browser of 2023 or later.`);
  throw fault;
});
