"use strict";
// Standard views of the scene, whose size is 1 and whose middle is at zero: from a direction, x, up and towards the viewer.
const VIEWS = {iso: [1.75, 1.05, 1.75], front: [0, 0, 1], top: [0, 1, 1e-4], right: [1, 0, 0]};
const AWAY = 2.55;  // distance of a camera from which a scene fits into a square window

class Views {
  constructor(viewer, pane) {
    Object.assign(this, {viewer, pane});
    new ResizeObserver(() => this.resize()).observe(pane);
    this.resize();
  }

  resize() {
    this.viewer.set_3d_pane_size(this.pane.clientWidth, this.pane.clientHeight);
  }

  // From a direction; without a name from where the camera is, as near as all is in view.
  look(name) {
    const {camera, controls} = this.viewer, away = camera.position.clone().sub(controls.target);
    if (name !== "fit") away.set(...VIEWS[name]);
    controls.target.set(0, 0, 0);
    camera.position.copy(away.setLength(AWAY / Math.min(camera.aspect, 1)));
    camera.zoom = 1;
    camera.updateProjectionMatrix();
    controls.update();
    this.viewer.set_dirty();
  }
}
