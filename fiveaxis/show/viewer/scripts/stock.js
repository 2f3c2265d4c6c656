"use strict";
// The stock as it is cut: quads that are there from one step to another. At another step, forwards or backwards,
// the list of those to draw is written anew.
const ROUNDING = 1e-6;  // s, of sums of durations

class CutStock {
  constructor({low, most, colour}, arrays) {
    const own = what => arrays[`stock/${what}`];
    for (const what of ["quads", "born", "gone", "clock", "rate"]) this[what] = own(what);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(own("vertices"), 3));
    geometry.setAttribute("color", new THREE.BufferAttribute(own("colours"), 3, true));
    this.index = new THREE.BufferAttribute(new Uint32Array(6 * most), 1).setUsage(THREE.DynamicDrawUsage);
    geometry.setIndex(this.index);
    geometry.computeBoundingSphere();
    this.plain = new THREE.Color(colour);
    this.mesh = new THREE.Mesh(geometry, new THREE.MeshPhongMaterial({flatShading: true, shininess: 5}));
    this.mesh.name = "stock";
    this.mesh.position.set(...low);
    this.step = null;
  }

  // Colour what is finished by what is left and gouged, or all alike.
  colour(byMap) {
    const {material} = this.mesh;
    material.vertexColors = byMap;
    material.color.copy(byMap ? new THREE.Color(1, 1, 1) : this.plain);
    material.needsUpdate = true;
  }

  // mm³/s at the step shown.
  get removal() { return this.rate[this.step]; }

  show(time) {
    const step = lastUpTo(this.clock, time + ROUNDING);
    if (step === this.step) return;
    this.step = step;
    const {quads, born, gone, index} = this, end = born.length;
    let at = 0;
    for (let quad = 0; quad < end && born[quad] <= step; quad++) {
      if (gone[quad] <= step) continue;
      const a = quads[4 * quad], c = quads[4 * quad + 2];
      index.array[at++] = a; index.array[at++] = quads[4 * quad + 1]; index.array[at++] = c;
      index.array[at++] = a; index.array[at++] = c; index.array[at++] = quads[4 * quad + 3];
    }
    index.updateRange.count = at;
    index.needsUpdate = true;
    this.mesh.geometry.setDrawRange(0, at);
  }
}
