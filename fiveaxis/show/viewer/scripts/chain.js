"use strict";
// The machine's chain as a product of exponentials, T(q) = E₁(q₁) … E_k(q_k) · M, as in kinematics/poses.py.
const {THREE} = MeshCat;

class Chain {
  constructor(machine) {
    Object.assign(this, {joints: machine.joints, links: machine.links});
    this.home = new THREE.Matrix4().fromArray(machine.tool_home);
    this.frame = new THREE.Matrix4().fromArray(machine.frame);
    for (const joint of this.joints) {
      joint.line = new THREE.Vector3(...joint.direction);
      joint.through = new THREE.Vector3(...joint.point);
    }
  }

  // The motion about or along a joint's line, for a value in rad or mm.
  static motion(joint, value) {
    const moved = new THREE.Matrix4();
    if (!joint.rotary) return moved.makeTranslation(...joint.line.clone().multiplyScalar(value).toArray());
    moved.makeRotationAxis(joint.line, value);
    const back = joint.through.clone().applyMatrix4(moved);
    return moved.setPosition(joint.through.clone().sub(back));
  }

  // How each link and the tool have moved from home, in the workpiece frame.
  poses(values) {
    let pose = new THREE.Matrix4();
    const found = {[this.links[0]]: pose};
    this.joints.forEach((joint, number) => {
      pose = pose.clone().multiply(Chain.motion(joint, values[joint.column]));
      found[this.links[number + 1]] = pose;
    });
    return {links: found, tool: pose.clone().multiply(this.home)};
  }

  // The workpiece frame as seen by the machine's bed.
  workpiece(links) { return this.frame.clone().multiply(links.bed.clone().invert()); }
}
