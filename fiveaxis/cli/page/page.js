"use strict";
// The page: what was dropped, the program as it is, what is asked, the work, and its result, one below the other.
const LARGEST = 200e6;
const PARTS = /\.(stl|step|stp|iges|igs|obj|ply|off)$/i, PATHS = /\.(csv|apt|cls|cld|cldata)$/i, TABLES = /\.(toml|ini|urdf|mch)$/i;
const S = { program: null, kind: null, part: null, machine: null, own: null, machines: [], answers: {}, tools: {}, options: {}, seen: null, ask: null };

const $ = (id) => document.getElementById(id);
const all = (css, root = document) => [...root.querySelectorAll(css)];
const safe = (text) => String(text).replace(/[&<>"']/g, (c) => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "'": "&#39;" })[c]);
const show = (id, html) => { $(id).innerHTML = html; $(id).hidden = !html; };
const number = (v, digits = 0) => v == null ? "–" : v.toLocaleString("en-GB", { minimumFractionDigits: digits, maximumFractionDigits: digits }).replace(/,/g, "\u202f");
const seconds = (s) => s == null ? "–" : s < 120 ? number(s, 1) + "\u202fs" : Math.floor(s / 60) + ":" + String(Math.round(s % 60)).padStart(2, "0") + "\u202fmin";
const joules = (j) => j == null ? "–" : j < 1e4 ? number(j) + "\u202fJ" : number(j / 1e3, 1) + "\u202fkJ";
const clock = (s) => Math.floor(s / 60) + ":" + String(Math.floor(s % 60)).padStart(2, "0");
const lines = (a, b) => a === b ? number(a) : number(a) + "–" + number(b);
const plain = (cause) => cause.text.replace(/^\w+: [\w-]+ \(\d+\): /, "").replace(/ \[[\w-]+\]$/, "").replace(/ \(--[^)]*\)/g, "");
const FIGURES = { limits: "X.limits=-250:250", line: "A.points=0,0,50", max_speed: "X.speeds=30", max_acceleration: "X.accelerations=2" };
const KINDS = { simultaneous: "5-axis", "3-axis": "3-axis", "3+2": "tilted (3+2)", drilling: "drilling", unread: "not understood" };

async function call(method, address, body) {
  let answer;
  try { answer = await fetch(address, { method, body, headers: { "X-Fiveaxis": "1" } }); }
  catch { throw Error("fiveaxis app has ended. Start it again in the terminal, and open the address that it prints."); }
  const text = await answer.text(), data = text ? JSON.parse(text) : {};
  if (!answer.ok) throw Error(data.error || answer.status);
  return data;
}
function fault(text, causes = []) {
  const more = causes.map((c) => safe(plain(c))).join("\n");
  show("fault", text ? `<div class="fault">${safe(text)}${more ? "\n\n" + more : ""}</div>` : "");
  if (text) $("fault").scrollIntoView({ block: "center" });
}

// What is dropped.
async function take(list) {
  fault("");
  const files = [...list], large = files.find((f) => f.size > LARGEST);
  if (large) return fault(`${large.name} has ${number(large.size / 1e6)} MB; a file may have ${LARGEST / 1e6} MB. Split it, or use the command line.`);
  const programs = files.filter((f) => !PARTS.test(f.name) && !TABLES.test(f.name));
  if (programs.length > 1) return fault(`Drop one program at a time: here are ${programs.map((f) => f.name).join(" and ")}.`);
  try {
    for (const file of files) {
      const sent = await call("PUT", "/file/" + file.name.replace(/^[^A-Za-z0-9_]+/, "").replace(/[^\w.-]/g, "_").slice(-120), file);
      const job = /\.toml$/i.test(file.name) && /^\s*input\s*=/m.test(await file.text());
      if (TABLES.test(file.name) && !job) { S.machine = S.own = sent.name; S.answers = {}; }
      else if (PARTS.test(file.name) && files.length > 1) S.part = sent.name;
      else { S.program = sent.name; S.kind = job ? "job" : PARTS.test(file.name) ? "part" : PATHS.test(file.name) ? "path" : "program"; S.tools = {}; S.options = {}; S.seen = null; }
    }
  } catch (reason) { return fault(reason.message); }
  if (!S.program && S.part) [S.program, S.part, S.kind] = [S.part, null, "part"];
  $("dropped").textContent = S.program ? S.program + (S.part ? " with " + S.part : "") : "Drop an NC program here";
  tiles();
}
function tiles() {
  const own = S.own ? [{ name: S.own, kind: "your machine file", axes: "", about: "" }] : [];
  const tile = (m) => `<button class="tile" data-machine="${safe(m.name)}" aria-pressed="${m.name === S.machine}"><b>${safe(m.name)}</b><span>${safe(m.kind.replace("-", " / "))} ${safe(m.axes)}</span></button>`;
  const focused = document.activeElement?.dataset?.machine;
  $("tiles").innerHTML = [...own, ...S.machines].map(tile).join("") + '<button class="tile" data-machine=""><b>Another machine</b><span>drop its file: .toml, .ini, .urdf, .mch</span></button>';
  for (const button of all("#tiles button")) {
    button.onclick = () => {
      if (!button.dataset.machine) return $("file").click();
      if (S.machine !== button.dataset.machine) S.answers = {};
      S.machine = button.dataset.machine;
      tiles();
    };
    if (button.dataset.machine === focused) button.focus();
  }
  $("about").textContent = S.machines.find((m) => m.name === S.machine)?.about || "";
  $("look").disabled = !(S.program && (S.machine || S.kind === "job"));
  $("look").textContent = S.kind && S.kind !== "program" ? "Continue" : "Look at it";
}

// The work: one piece at a time, also of another window.
async function run(verb, ask, words) {
  fault("");
  S.ask = { ...ask, program: S.program, machine: S.machine, part: S.part, answers: S.answers, ...S.options };
  try { await call("POST", "/run/" + verb, JSON.stringify(S.ask)); return await follow(words); }
  catch (reason) { $("busy").hidden = true; fault(reason.message); return null; }
}
async function follow(words, each = () => {}) {
  $("doing").textContent = words;
  $("busy").hidden = false;
  $("doing").focus();
  for (let shown = false; ;) {
    const s = await call("GET", "/state");
    if (s.share == null) $("bar").removeAttribute("value"); else $("bar").value = s.share;
    if ($("stage").textContent !== s.stage) $("stage").textContent = s.stage || "";
    $("clock").textContent = clock(s.elapsed) + (s.left == null ? "" : ", about " + clock(s.left) + " more");
    if (s.seen && !shown) { shown = true; S.seen = s.seen; asItIs(); }
    if (s.end) {
      $("busy").hidden = true;
      if (!s.end.error) return s.end.result;
      if (s.end.error !== "cancelled") fault(s.end.error, s.end.causes);
      return null;
    }
    await new Promise((done) => setTimeout(done, 250));
  }
}

const three = (now, before, against) => {
  const cell = (name, key, text, word) => {
    const share = before?.[key] ? now[key] / before[key] - 1 : 0, same = Math.abs(share) < 0.005;
    const change = same ? "as before" : share > 2 ? number(now[key] / before[key]) + " times as much" : number(Math.abs(100 * share), Math.abs(share) < 0.1 ? 1 : 0) + "\u202f% " + (share < 0 ? "less" : "more");
    return `<div><small>${name}</small><strong>${text(now[key])}</strong>` + (before ? `<em class="${same ? "" : share < 0 ? "good" : "bad"}">${change}</em><em>${safe(against)}: ${text(before[key])}</em>` : `<em>${word || "&nbsp;"}</em>`) + "</div>";
  };
  const lost = S.seen ? S.seen.operations.reduce((sum, o) => sum + o.lost, 0) : 0;
  return '<div class="three">' + cell("Time", "time", seconds, lost > 0.5 ? `<span class="bad">${seconds(lost)} lost to slow places</span>` : "") + cell("Energy of the axis drives", "energy", joules) + cell("Axis starts and reversals", "turns", number) + "</div>";
};

// A program as it is.
function asItIs() {
  const operations = S.seen.operations, places = operations.flatMap((o) => o.slow.map((p) => ({ ...p, number: o.number }))).sort((a, b) => b.lost - a.lost);
  const row = (o) => `<tr class="${o.stays ? "stays" : ""}"><td>${o.number}<td>${lines(o.first_line, o.last_line)}<td>${KINDS[o.kind] || safe(o.kind)}<td>${safe([o.tool, o.cutter].filter(Boolean).join(" "))}<td class="n">${o.cut_length == null ? "–" : number(o.cut_length) + " mm"}<td class="n">${seconds(o.energy?.time)}<td class="n">${joules(o.energy?.total)}<td>${o.fault ? safe(o.fault) : o.kind === "simultaneous" && !o.cutter && !S.tools[o.tool || ""] ? "needs its tool: name it below" : o.stays ? safe(o.stays) : "<b>can be improved</b>"}</tr>`;
  const slow = (p) => `<tr><td>${p.number}<td>${lines(p.first, p.last)}<td>${safe(p.cause || "limits")}<td class="n">${p.asked == null ? "–" : number(p.asked)}<td class="n">${p.got == null ? "–" : number(p.got)}<td class="n">${seconds(p.lost)}</tr>`;
  const notes = [...S.seen.assumed, ...S.seen.summary.filter((c) => c.severity !== "note").map(plain)];
  show("seen", `<h2 tabindex="-1">As it is</h2>` + three(S.seen.totals)
    + '<div class="scroll"><table><tr><th><th>Lines<th>Kind<th>Tool<th class="n">Cut<th class="n">Time<th class="n">Energy<th></tr>' + operations.map(row).join("") + "</table></div>"
    + (places.length ? '<h2>Slow places</h2><div class="scroll"><table><tr><th><th>Lines<th>Because of<th class="n">Asked, mm/min<th class="n">Got, mm/min<th class="n">Lost</tr>' + places.slice(0, 8).map(slow).join("") + "</table></div>" + (places.length > 8 ? `<p class="soft">and ${places.length - 8} more</p>` : "") : "<p>No slow places: no axis has to slow the feed down by much.</p>")
    + (notes.length ? `<div class="note"><ul>${notes.map((n) => `<li>${safe(n)}</li>`).join("")}</ul></div>` : ""));
  missing();
  askProgram();
}
function missing() {
  const fields = S.seen.missing.map((m) => `<p class="row"><label for="m-${safe(m.name)}">${safe(m.text)}</label><input type="text" id="m-${safe(m.name)}" data-name="${safe(m.name)}" placeholder="${safe(m.form)}"></p>`).join("");
  const kept = Object.keys(S.answers).length ? '<p><a class="button" href="/out/machine.toml" download>Download your machine file</a> <span class="soft">so that it is asked once</span></p>' : "";
  show("missing", fields || kept ? `<h2>${fields ? "What the machine’s file doesn’t say" : "Your machine"}</h2>${fields}${fields ? '<p><button id="answer">Use these</button></p>' : ""}${kept}` : "");
  if ($("answer")) $("answer").onclick = () => { collect($("missing")); $("look").click(); };
}
function collect(root) {
  for (const field of all("input[data-name]", root)) {
    const value = field.value.trim(), name = field.dataset.name;
    if (!value) continue;
    if (["rapid", "tool_length", "retract"].includes(name)) S.options[name] = +value;
    else if (name === "answers") for (const part of value.split(",")) { const [key, text] = part.split("=").map((t) => t.trim()); if (text) S.answers[key] = text; }
    else S.answers[name] = value;
  }
}

// What is asked before the work.
const cutter = (name) => `<span data-tool="${safe(name)}"><select aria-label="shape of tool ${safe(name)}"><option value="ball">ball<option value="flat">flat<option value="bull">corner radius</select> <input type="number" min="0" step="any" class="d" aria-label="diameter of tool ${safe(name)}, mm" placeholder="⌀ mm"> <input type="number" min="0" step="any" class="r" aria-label="corner radius of tool ${safe(name)}, mm" placeholder="radius mm" hidden></span>`;
const effort = '<p class="row"><label for="effort">Take</label><select id="effort"><option value="quick">a quick look<option value="normal" selected>the usual time<option value="thorough">as long as it needs</select></p>';
function cutters(root) {
  for (const each of all("[data-tool]", root)) each.querySelector("select").onchange = (e) => { each.querySelector(".r").hidden = e.target.value !== "bull"; };
}
function toolsOf(root) {
  for (const each of all("[data-tool]", root)) {
    const [shape, d, r] = [each.querySelector("select").value, each.querySelector(".d").value, each.querySelector(".r").value];
    if (!d) { fault("Give the diameter of the tool."); each.querySelector(".d").focus(); return false; }
    S.tools[each.dataset.tool] = shape === "bull" ? `bull:${d}:${r || 1}` : `${shape}:${d}`;
  }
  return true;
}
function askProgram() {
  const able = S.seen.operations.filter((o) => o.kind === "simultaneous");
  if (!able.length) return show("ask", "<h2>Nothing to improve</h2><p>Only work that turns the tool while it cuts can be improved, and this program has none.</p>");
  const unknown = [...new Set(able.filter((o) => !o.cutter && !S.tools[o.tool || ""]).map((o) => o.tool || ""))];
  show("ask", "<h2>Improve it</h2>"
    + (able.length > 1 ? `<p class="row"><label>Operations</label>${able.map((o) => `<label><input type="checkbox" name="operation" value="${o.number}" checked> ${o.number}</label>`).join("")}</p>` : "")
    + unknown.map((t) => `<p class="row"><label>Tool ${safe(t)}</label>${cutter(t)}</p>`).join("")
    + '<p class="row"><label for="lean">The tool may lean by up to</label><input type="number" id="lean" value="15" min="1" max="90"> ° from where it is now</p>' + effort
    + '<p class="row"><button class="go" id="go">Improve</button><span class="soft">Your file stays as it is. You get a new one if it is better.</span></p>');
  cutters($("ask"));
  $("go").onclick = () => {
    if (!toolsOf($("ask"))) return;
    const picked = all("[name=operation]:checked").map((c) => +c.value);
    if (able.length > 1 && !picked.length) return fault("Choose an operation.");
    improve({ operations: able.length > 1 ? picked : [able[0].number], cone: +$("lean").value, effort: $("effort").value, tool: toolText() });
  };
}
function toolText() {
  const named = Object.entries(S.tools), stated = S.seen.operations.filter((o) => o.cutter && !S.tools[o.tool]).map((o) => [o.tool, o.cutter]);
  if (!named.length) return null;
  return named.length === 1 && !named[0][0] ? named[0][1] : [...named, ...stated].map(([name, tool]) => `${name}=${tool}`).join(",");
}
function askPart() {
  S.seen = null;
  show("missing", "");
  const tilts = (low, high) => `<p class="row"><label for="t0">Tilt against the surface</label><input type="number" id="t0" value="${low}"> to <input type="number" id="t1" value="${high}" aria-label="largest tilt, degrees"> °</p>`;
  const job = S.kind === "job", path = S.kind === "path", field = (id, text, value, unit) => `<p class="row"><label for="${id}">${text}</label><input type="number" id="${id}" value="${value}" step="any"> ${unit}</p>`;
  show("ask", `<h2 tabindex="-1">Cut ${safe(S.program)}</h2>` + (job ? '<p class="soft">Tool, bounds and cuts are those of the job file.</p>'
    : `<p class="row"><label>Tool</label>${cutter("")}</p>`
    + (path ? field("lean", "The tool may lean by up to", 15, "° from its programmed axis, or, where the path has none:") + tilts("", "")
      : tilts(10, 40) + `<p class="row"><label for="strategy">Passes</label><select id="strategy"><option value="waterline">horizontal sections<option value="raster">vertical, parallel<option value="flow">along the faces of a CAD file</select></p>` + field("stepdown", "Stepdown", 1, "mm") + field("feed", "Feed", 1000, "mm/min"))
    + '<p class="row"><label for="control">Control</label><input type="text" id="control" placeholder="that of the machine"></p>') + effort + '<p><button class="go" id="go">Make the program</button></p>');
  cutters($("ask"));
  $("ask").querySelector("h2").focus();
  $("go").onclick = () => {
    if (!job && !(path && !all(".d")[0].value) && !toolsOf($("ask"))) return;
    const value = (id) => $(id)?.value ? +$(id).value : null, tilted = value("t0") != null && value("t1") != null;
    improve({ effort: $("effort").value, tool: S.tools[""] || null, control: $("control")?.value || null, cone: path && !tilted ? value("lean") : null, tilt: tilted ? [value("t0"), value("t1")] : null, stepdown: value("stepdown"), strategy: $("strategy")?.value || null, feed: value("feed") });
  };
}

// The result.
async function improve(ask) {
  for (const id of ["result", "ask", "missing"]) $(id).hidden = true;
  const result = await run("improve", ask, S.seen ? "Looking for better tool angles" : "Making the program");
  for (const id of ["ask", "missing"]) $(id).hidden = !$(id).innerHTML;
  if (result) answer(result, ask);
}
const WORSE = { slower: "takes longer", rougher: "starts and reverses its axes more often" };
function answer(r, ask) {
  const less = (key, word) => r.before && r.after[key] < 0.995 * r.before[key] ? `${number(100 * (1 - r.after[key] / r.before[key]))}\u202f% ${word}` : null;
  const gains = [less("time", "less time"), less("energy", "less energy"), less("turns", "fewer starts and reversals")].filter(Boolean).join(", ");
  const heads = { better: `Better: ${gains}.`, trade: `A trade: ${gains}, but not better in everything.`, needed: "The program as it was has errors; the new one hasn’t.", new: gains ? `Your program: ${gains} than with ${r.against}.` : "Your program.", stays: "Nothing was changed.", "already better": "Yours is already better. Nothing was written." };
  const head = r.verified ? heads[r.verdict] : "The new program has an error. Nothing was written.";
  const extension = /\.\w+$/.exec(r.program || "")?.[0] || "", name = S.program.replace(/\.\w+$/, "") + "-improved" + extension;
  const other = r.other ? `<p>The cheapest other saves ${number(100 * r.other.saved, 1)}\u202f%, but ${r.other.trades.map((t) => WORSE[t]).join(" and ")}. <button id="trade">Make it anyway</button></p>` : "";
  const risk = (k) => `<li>${safe(k.what.join("; "))}` + (k.to === "job" && k.add.startsWith("retract") ? ': <label>retract to Z <input type="number" data-name="retract" step="any"> mm</label>' : k.to === "machine file" ? `: <label>${safe(k.add)} <input type="text" data-name="answers" placeholder="${FIGURES[k.add] || "NAME=VALUE"}"></label>` : k.to ? `: add ${safe(k.add)} to the ${safe(k.to)}` : "") + "</li>";
  const tabs = r.pages.flatMap((p) => [["Simulation", "preview"], ["Report", "report"]].map(([word, file]) => [`${word} ${p.name}`.trim(), `/out/result/${p.folder}${file}.html`]));
  show("result", `<p class="verdict ${["better", "new", "needed"].includes(r.verdict) && r.verified ? "good" : ""}" tabindex="-1">${safe(head)}</p>` + (r.pages.length ? three(r.after, r.before, r.against) : (r.parts || []).filter((p) => p.verdict === "already better").map((p) => `<p>${safe(p.why)}</p>`).join("")) + other
    + (r.program ? `<p class="row"><a class="button get" id="get" download href="/out/result/${safe(r.program)}?as=${encodeURIComponent(name)}">Download the program</a>` + (r.pages.length ? `<a class="button" download href="/out/result/${r.pages[0].folder}report.html">Download the report</a>` : "") + (Object.keys(S.answers).length ? '<a class="button" download href="/out/machine.toml">Download your machine file</a>' : "") + "</p>" : "")
    + (r.found.length ? `<div class="note"><ul>${r.found.map((c) => `<li>${safe(plain(c))}</li>`).join("")}</ul></div>` : "")
    + (r.risks.length ? `<h2>Not checked</h2><ul>${r.risks.map(risk).join("")}</ul>` + (r.risks.some((k) => k.to === "machine file" || k.add.startsWith("retract")) ? '<p><button id="again">Use these, and do it again</button></p>' : "") : "")
    + (tabs.length ? frames(tabs) : ""));
  tabbed($("result"));
  if ($("trade")) $("trade").onclick = () => improve({ ...ask, allow: r.other.trades });
  if ($("again")) $("again").onclick = () => { collect($("result")); improve(ask); };
  $("result").scrollIntoView();
  $("result").querySelector(".verdict").focus();
}
const frames = (tabs) => `<div class="tabs" role="tablist">${tabs.map(([word, address], k) => `<button role="tab" aria-selected="${!k}" data-address="${address}">${safe(word)}</button>`).join("")}<a target="_blank" rel="noopener" href="${tabs[0][1]}">alone</a></div><iframe title="${safe(tabs[0][0])}" sandbox="allow-scripts" src="${tabs[0][1]}"></iframe>`;
function tabbed(root) {
  for (const tab of all("[role=tab]", root)) tab.onclick = () => {
    for (const other of all("[role=tab]", root)) other.setAttribute("aria-selected", other === tab);
    root.querySelector("iframe").src = root.querySelector(".tabs a").href = tab.dataset.address;
    root.querySelector("iframe").title = tab.textContent;
  };
}

$("file").onchange = (event) => { take(event.target.files); event.target.value = ""; };
for (const name of ["dragover", "dragleave", "drop"]) addEventListener(name, (event) => {
  event.preventDefault();
  $("drop").classList.toggle("over", name === "dragover");
  if (name === "drop") take(event.dataTransfer.files);
});
$("cancel").onclick = () => call("DELETE", "/state").catch((reason) => fault(reason.message));
function chooseAgain() {
  for (const id of ["chosen", "result", "seen", "missing", "ask", "watch"]) $(id).hidden = true;
  $("choose").hidden = false;
}
$("change").onclick = () => { chooseAgain(); fault(""); $("choose").querySelector("h1").focus(); };
$("look").onclick = async () => {
  for (const id of ["choose", "result", "seen", "missing", "ask", "watch"]) $(id).hidden = true;
  $("chosen").hidden = false;
  $("which").textContent = S.program;
  $("where").textContent = S.machine || "the machine of the job";
  if (S.kind !== "program") return askPart();
  const result = await run("look", { tool: Object.keys(S.tools).length && S.seen ? toolText() : null }, "Looking at your program");
  if (!result) return $("seen").hidden ? chooseAgain() : undefined;
  show("watch", "<h2>Watch it</h2>" + (result.simulation ? frames([["Simulation", "/out/" + result.simulation]]) : `<p>${safe(result.no_simulation)}</p>`));
  tabbed($("watch"));
};
(async () => {
  try {
    const state = await call("GET", "/state");
    if (state.ask && !state.end) {
      Object.assign(S, { program: state.ask.program.split(/[\\/]/).pop(), machine: (state.ask.machine || "").split(/[\\/]/).pop(), kind: "program" });
      const result = await follow("This work began in another window");
      if (result?.pages) answer(result, state.ask);
    }
    S.machines = await call("GET", "/machines").then((found) => found.machines);
    tiles();
  } catch (reason) { fault(reason.message); }
})();
