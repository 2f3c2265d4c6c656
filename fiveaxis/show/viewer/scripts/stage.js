"use strict";
// What is seen of one motion: workpiece with its path, links, tool. The second one is a copy of the first.
const RAPID_COLOUR = [0.36, 0.38, 0.42];
const child = (group, path) => path.split("/").reduce(
  (found, name) => found && found.children.find(one => one.name === name), group);

// Of a share of the colour scale, which has a colour at each of its ends and between them.
function colourOf(share, scale, into, at) {
  const place = Math.min(Math.max(share, 0), 1) * (scale.length - 1), low = Math.min(Math.floor(place), scale.length - 2);
  for (let k = 0; k < 3; k++)
    into[at + k] = scale[low][k] + (place - low) * (scale[low + 1][k] - scale[low][k]);
}

function pathOf(side, {top, scale}) {
  const moves = side.count - 1, ends = new Float32Array(6 * moves), colours = new Float32Array(6 * moves);
  for (let move = 0; move < moves; move++) {
    ends.set(side.points.subarray(3 * move, 3 * move + 6), 6 * move);
    if (side.cutting[move + 1]) colourOf(side.total[move + 1] / top, scale, colours, 6 * move);
    else colours.set(RAPID_COLOUR, 6 * move);
    colours.copyWithin(6 * move + 3, 6 * move, 6 * move + 3);
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(ends, 3));
  geometry.setAttribute("color", new THREE.BufferAttribute(colours, 3));
  const line = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({vertexColors: true}));
  line.name = "path";
  return line;
}

class Stage {
  constructor(group, chain) {
    Object.assign(this, {group, chain, side: null, row: 0});
    this.workpiece = child(group, "workpiece");
    this.links = Object.fromEntries(child(group, "links").children.map(link => [link.name, link]));
    this.tool = child(group, "tool");
    for (const moving of [group, this.tool, ...Object.values(this.links)]) moving.matrixAutoUpdate = false;
  }

  follow(side, head) {
    if (this.side === side) return;
    const old = child(this.workpiece, "path");
    if (old) { this.workpiece.remove(old); old.geometry.dispose(); old.material.dispose(); }
    this.side = side;
    this.workpiece.add(pathOf(side, head));
  }

  // Put everything where it is at a row, in the frame of the machine or of the part.
  show(row, inMachine, shift) {
    const {links, tool} = this.chain.poses(this.side.values(row));
    this.row = row;
    for (const [name, link] of Object.entries(this.links)) link.matrix.copy(links[name]);
    this.tool.matrix.copy(tool);
    const used = this.side.tool && String(this.side.tool[this.side.end(row)]);
    if (used) for (const one of this.tool.children) one.visible = one.name === used;
    this.group.matrix.copy(inMachine ? this.chain.workpiece(links) : new THREE.Matrix4());
    if (shift) this.group.matrix.premultiply(new THREE.Matrix4().makeTranslation(...shift));
    this.group.updateMatrixWorld(true);
  }

  // The row of the path's point that is drawn nearest to a place of the view, and how far off it is, in pixels.
  nearest(camera, x, y, width, height) {
    const along = camera.projectionMatrix.clone().multiply(camera.matrixWorldInverse).multiply(this.workpiece.matrixWorld);
    const m = along.elements, points = this.side.points;
    let best = -1, least = Infinity;
    for (let row = 0; row < this.side.count; row++) {
      const [a, b, c] = [points[3 * row], points[3 * row + 1], points[3 * row + 2]];
      const w = m[3] * a + m[7] * b + m[11] * c + m[15];
      if (w <= 0) continue;
      const u = ((m[0] * a + m[4] * b + m[8] * c + m[12]) / w + 1) * width / 2 - x;
      const v = (1 - (m[1] * a + m[5] * b + m[9] * c + m[13]) / w) * height / 2 - y;
      const off = u * u + v * v;
      if (off < least) { least = off; best = row; }
    }
    return {row: best, off: Math.sqrt(least)};
  }
}
