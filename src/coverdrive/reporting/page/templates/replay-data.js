"use strict";
/* The data of a drive: undoes what the Python module `replay` did. */
async function readDrive(text) {
  const drive = JSON.parse(text);
  const packed = Uint8Array.from(atob(drive.data), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const count = bytes.length / 4;
  let offset = 0;
  for (const [name, { shape, unit, axis }] of Object.entries(drive.arrays)) {
    const size = shape.reduce((product, length) => product * length, 1);
    const whole = new Int32Array(size);
    for (let i = 0; i < size; i++) {
      const at = offset + i;
      whole[i] = bytes[at] | (bytes[count + at] << 8) | (bytes[2 * count + at] << 16) | (bytes[3 * count + at] << 24);
    }
    if (axis !== null) accumulate(whole, shape, axis);
    drive[name] = unit === 1 ? whole : Float64Array.from(whole, (number) => number * unit);
    offset += size;
  }
  delete drive.data;
  drive.steps = drive.counts.length;
  drive.slots = drive.arrays.valid.shape[1];
  [drive.points, , drive.total] = drive.arrays.paths.shape;
  drive.planPoints = drive.arrays.plan.shape[1];
  drive.planSteps = drive.arrays.slack.shape[1];
  drive.first = [0];
  drive.counts.forEach((number, step) => drive.first.push(drive.first[step] + number));
  return drive;
}

function accumulate(values, shape, axis) {
  const stride = shape.slice(axis + 1).reduce((product, length) => product * length, 1);
  const block = stride * shape[axis];
  for (let start = 0; start < values.length; start += block) {
    for (let i = start + stride; i < start + block; i++) values[i] += values[i - stride];
  }
}

/* What the readings and the course show of one step. */
function reading(drive, step) {
  const slack = drive.slack.subarray(step * drive.planSteps, (step + 1) * drive.planSteps);
  const first = drive.first[step], end = drive.first[step + 1];
  let active = 0;
  for (let path = first; path < end; path++) if (drive.active[path]) active++;
  return {
    speed: drive.speed[step * drive.slots + drive.own], acceleration: drive.input[2 * step], status: drive.statuses[drive.status[step]],
    milliseconds: drive.milliseconds[step], severity: drive.severity[step], reason: drive.reasons[step], slack: Math.max(0, ...slack), paths: end - first, active,
  };
}

/* How many vehicles have left their predicted sets. */
function countLeft(drive, moment) {
  return drive.left.subarray(moment * drive.slots, (moment + 1) * drive.slots).reduce((count, left) => count + left, 0);
}

/* A name as part of a name of the style sheet. */
function slug(name) {
  return name.replaceAll(" ", "-");
}
