"use strict";
const body = document.querySelector("tbody");
const rows = Array.from(body.rows);
const heads = Array.from(document.querySelectorAll("thead th"));
const marks = Array.from(document.querySelectorAll(".mark"));
const words = document.getElementById("words");
const state = document.getElementById("state");
const tip = document.getElementById("tip");

// A number, or text; empty cells are last in both directions.
function compare(one, other) {
  const [a, b] = [one.dataset.value, other.dataset.value];
  if (a !== undefined && b !== undefined) return Number(a) - Number(b);
  return one.textContent.localeCompare(other.textContent, "en", { numeric: true });
}

function sort(head) {
  const column = heads.indexOf(head);
  const falling = head.getAttribute("aria-sort") === "ascending";
  heads.forEach((each) => each.removeAttribute("aria-sort"));
  head.setAttribute("aria-sort", falling ? "descending" : "ascending");
  const isEmpty = (row) => row.cells[column].textContent === "";
  const sorted = rows.slice().sort((one, other) => {
    if (isEmpty(one) || isEmpty(other)) return isEmpty(one) - isEmpty(other);
    const order = compare(one.cells[column], other.cells[column]);
    return falling ? -order : order;
  });
  body.append(...sorted);
}

function filter() {
  const asked = words.value.toLowerCase().split(/\s+/).filter(Boolean);
  let shown = 0;
  for (const row of rows) {
    const text = Array.from(row.cells, (cell) => cell.textContent).join(" ").toLowerCase();
    const kept = asked.every((word) => text.includes(word));
    row.hidden = !kept || (state.value !== "" && row.dataset.state !== state.value);
    shown += !row.hidden;
  }
  for (const mark of marks) mark.toggleAttribute("hidden", document.getElementById(mark.dataset.job).hidden);
  document.getElementById("count").textContent = `${shown} of ${rows.length} shown`;
}

function showTip(mark) {
  const place = mark.getBoundingClientRect();
  tip.textContent = mark.dataset.words;
  tip.hidden = false;
  const right = document.documentElement.clientWidth - tip.offsetWidth - 8;
  tip.style.left = `${Math.max(8, Math.min(place.right + 6, right))}px`;
  tip.style.top = `${Math.max(8, place.top - tip.offsetHeight - 6)}px`;
}

for (const head of heads) head.querySelector("button")?.addEventListener("click", () => sort(head));
for (const mark of marks) {
  for (const kind of ["pointerenter", "focus"]) mark.addEventListener(kind, () => showTip(mark));
  for (const kind of ["pointerleave", "blur"]) mark.addEventListener(kind, () => { tip.hidden = true; });
}
words.addEventListener("input", filter);
state.addEventListener("input", filter);
document.getElementById("choice").hidden = false;
// A browser that comes back to the page fills the form in again.
filter();
