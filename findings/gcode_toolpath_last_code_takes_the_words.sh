#!/bin/sh
# A preview leaves the first moves of most programs out, and goes on from where they never went.
#
# Run: gcode-toolpath 3.0.0 (npm), with gcode-interpreter 3.0.0 and gcode-parser 2.2.0: the
# interpreter behind CNCjs' picture of a program.
#
# Guess before the run: words belong to the line, as in every control. "G0 G90 G54 X100 Y50" goes
# there, "G43 Z15 H1" goes to Z15 by the G0 in force, and G53 doesn't speak of the work's coordinates.
# The source, read before the run, gave the words to the last G or M code before them.
#
# What happens: it is as the source has it. If that code isn't G0 to G3, the words are dropped: behind
# G90, G54 or G43, and behind M8 in the middle of a line. The tool stays where it was, and what
# follows starts there. With G53 in front of G0 the words are kept, and Z0 of the machine is drawn as
# Z0 of the work. A motion code that stands last is read well. There is no message.
#
# Why it matters: posts begin each tool with G0 G90 G54 X Y and G43 Z H, and end it with G53 G0 Z0.
# So the approach above the clamps isn't drawn, the first plunge is drawn at the work's zero, and the
# retract goes down into the part. The box around the path is wrong in the same way. Write the motion
# code last on the line.
#
# Exit: 0 as described, 1 it has changed, 2 the packages could not be installed.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund gcode-toolpath@3.0.0 gcode-interpreter@3.0.0 gcode-parser@2.2.0 || exit 2
cat >run.js <<'JAVASCRIPT'
const Toolpath = require('gcode-toolpath');

const PROGRAMS = {
  'G0 G90 G54 X100 Y50/G43 Z15 H1/G1 Z-5 F300': ['0 0 0', '0 0 -5'],
  'G90 G54 G0 X100 Y50/G43 H1 G0 Z15/G1 Z-5 F300': ['100 50 0', '100 50 15', '100 50 -5'],
  'G1 X100/G91 X10/G90 X20': ['100 0 0'],
  'G1 X100 M8 Y50': ['100 0 0'],
  'G0 Z15/G53 G0 Z0': ['0 0 15', '0 0 0'],
};
console.log('gcode-toolpath', require('gcode-toolpath/package.json').version);
console.log('expected: each line goes where its words say');
let asStated = true;
for (const [program, stated] of Object.entries(PROGRAMS)) {
  const seen = [];
  const addLine = (modal, from, to) => seen.push(`${to.x} ${to.y} ${to.z}`);
  new Toolpath({ addLine }).loadFromStringSync(program.replaceAll('/', '\n'));
  console.log(`seen: ${program} goes to ${seen.join(', ')}`);
  asStated = asStated && JSON.stringify(seen) === JSON.stringify(stated);
}
console.log(asStated ? 'as stated' : 'CHANGED');
process.exit(asStated ? 0 : 1);
JAVASCRIPT
node run.js
