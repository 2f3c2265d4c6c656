"use strict";
// Unpacks the scene into meshcat's viewer and connects the page's controls to it.
const report = text => { const line = document.getElementById("fault"); line.textContent = text; line.hidden = false; };
const pick = selector => document.querySelector(selector);
const pickAll = selector => [...document.querySelectorAll(selector)];
const parts = path => path.split("/").filter(name => name.length > 0);

async function unpack(text) {
  const packed = Uint8Array.from(atob(text.trim()), character => character.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const length = new DataView(bytes.buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + length)));
  let start = 4 + length;
  const commands = head.lengths.map(size => bytes.subarray(start, start += size));
  return {head, commands};
}

// Shared objects are sent once and cloned for the baseline.
function copy(viewer, head) {
  for (const [from, to] of Object.entries(head.copies)) {
    const twin = viewer.scene_tree.find(parts(`${head.root}/${from}`)).object.clone();
    twin.visible = true;
    viewer.scene_tree.find(parts(`${head.root}/${to}`)).set_object(twin);
  }
}

function arrange(viewer, head) {
  const node = name => `${head.root}/${name}`;
  const show = (name, visible) => viewer.handle_command(
    {type: "set_property", path: node(name), property: "visible", value: visible});
  const move = (path, matrix) => viewer.handle_command({type: "set_transform", path, matrix});
  const chosen = pick('input[name="view"]:checked');
  const view = chosen ? chosen.value : "after", apart = view === "apart";
  const identity = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
  const machine = pick('#legend input[value="machine"]');
  const layout = machine && machine.checked ? head.machine_layout : head.layout;
  move(head.root, apart ? layout.apart : layout.together);
  show("after", view !== "before");
  if (chosen) {
    show("before", view !== "after");
    move(node("before"), apart ? layout.shift : identity);
  }
  for (const box of pickAll("#legend input[type=checkbox]")) {
    const name = box.value, moves = name === "machine";
    show(name, box.checked && !(moves && view === "before"));
    if (chosen && box.dataset.copied)
      show(`before/${name}`, box.checked && (apart || (moves && view === "before")));
  }
}

// One slider for the whole show; the clock shows machine time.
function operate(viewer, head) {
  const animator = viewer.animator, slider = pick("#time"), button = pick("#play"), clock = pick("#clock");
  slider.max = head.duration;
  const locationAt = time => {
    let low = 0, high = head.times.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (head.times[middle] <= time) low = middle; else high = middle - 1;
    }
    const next = Math.min(low + 1, head.times.length - 1);
    return head.rows[head.times[next] - time < time - head.times[low] ? next : low];
  };
  const update = () => {
    clock.textContent = `${(animator.time * head.pace).toFixed(1)} s, location ${locationAt(animator.time)}`;
    button.textContent = animator.playing ? "pause" : "play";
  };
  const seek = time => { animator.pause(); animator.seek(time); animator.display_progress(time); update(); };
  button.addEventListener("click", () => { animator.playing ? animator.pause() : animator.play(); update(); });
  slider.addEventListener("input", () => seek(Number(slider.value)));
  pick("#speed").addEventListener("change", event => { animator.mixer.timeScale = Number(event.target.value); });
  for (const entry of pickAll("[data-time]"))
    entry.addEventListener("click", () => { slider.value = entry.dataset.time; seek(Number(entry.dataset.time)); });
  document.addEventListener("keydown", event => {
    if (event.code === "Space" && event.target === document.body) { event.preventDefault(); button.click(); }
  });
  let last = "";
  const follow = () => {
    // meshcat's own controls may move the clock too.
    const state = `${animator.time} ${animator.playing}`;
    if (state !== last) { slider.value = animator.time; update(); last = state; }
    requestAnimationFrame(follow);
  };
  follow();
}

let viewer = null;
async function start() {
  viewer = new MeshCat.Viewer(pick("#meshcat-pane"));
  const {head, commands} = await unpack(pick("#scene").textContent);
  pick("#scene").remove();
  for (const command of commands) viewer.handle_command_bytearray(command);
  copy(viewer, head);
  arrange(viewer, head);
  for (const input of pickAll("#legend input")) input.addEventListener("change", () => arrange(viewer, head));
  operate(viewer, head);
  viewer.set_3d_pane_size();
  document.body.dataset.ready = "yes";
}
start().catch(fault => {
  report(`The scene can't be shown: ${fault.message}. It needs WebGL and a browser of 2023 or later.`);
  throw fault;
});
