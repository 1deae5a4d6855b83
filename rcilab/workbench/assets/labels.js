// Words in the scene stay inside it: viser draws a label from its anchor on, past the edge where a panel begins. Just
// before a frame's labels are drawn, those that would be seen in part are moved until they are seen whole, and those that
// would lie on another one, on the toolbar or on a legend are moved off it.
// viser 1.1 has no public way to its labels; where they are not found as expected, they stay as viser has them.
// Unnecessary once viser keeps labels inside the scene, and apart from each other.
(() => {
  "use strict";
  const LOOK = 700, MARGIN = 6;  // [ms] between two looks for viser's labels and what lies on the scene; [px] A choice.
  const TOUCH = 1e-6;  // Of the picture: edges that meet do not overlap.
  const isLabels = (node) => node.isMesh && node.material.uniforms && node.material.uniforms.uLabelData && !node.material.uniforms.uAtlas;
  const topOf = (node) => { while (node && node.parent) node = node.parent; return node; };
  let boxes = [], drawn = -1;  // The meshes of the labels' backgrounds: one instance a label.
  let bar = null, covered = [];  // Edges of the toolbar, and of all else that lies on the picture, across and along it.

  // Returns how far to move what reaches from low to high so that it lies within two ends; its beginning does at least.
  const inward = (low, high, first, last) => Math.max(Math.min(0, last - high), first - low);

  // Returns how far up, or else down, a label must go to lie on none of the others, by its edges in the picture.
  const clear = (left, right, low, high, others) => {
    const free = (lift) => others.every((o) => left >= o[1] - TOUCH || right <= o[0] + TOUCH || low + lift >= o[3] - TOUCH || high + lift <= o[2] + TOUCH);
    const lifts = [0, ...others.flatMap((o) => [o[3] - low, o[2] - high])].filter((lift) => low + lift >= -1 && high + lift <= 1 && free(lift));
    return lifts.reduce((best, lift) => (Math.abs(lift) < Math.abs(best) ? lift : best), lifts.length ? lifts[0] : 0);
  };

  const keepInside = (camera) => {
    const { uLabelData, uFovScale, uViewportHeight, uIsOrtho } = boxes[0].material.uniforms;
    const data = uLabelData.value.image.data, view = camera.matrixWorldInverse.elements, world = camera.matrixWorld.elements;
    if (drawn === uLabelData.value.version || uIsOrtho.value > 0.5) return;  // Uploaded once a frame.
    drawn = uLabelData.value.version;
    const placed = [...covered];
    for (const { geometry } of boxes) {
      const { aLabelIndex, aRect, aParams } = geometry.attributes;
      for (let i = 0; aLabelIndex && i < geometry.instanceCount; i++) {
        const at = 4 * aLabelIndex.array[i], [x, y, z, isShown] = data.subarray(at, at + 4);
        if (!isShown) continue;
        const [right, up, back] = [0, 1, 2].map((k) => view[k] * x + view[4 + k] * y + view[8 + k] * z + view[12 + k]);
        const halfWidth = -back / camera.projectionMatrix.elements[0], halfHeight = -back / camera.projectionMatrix.elements[5];
        if (back >= 0) continue;  // Behind the camera.
        const [isScreen, size] = aParams.array.subarray(2 * i, 2 * i + 2), [left, low, width, height] = aRect.array.subarray(4 * i, 4 * i + 4);
        const scale = isScreen > 0.5 ? size * (-back / 10) * uFovScale.value * (800 / uViewportHeight.value) : size;  // As viser's shader.
        const margin = MARGIN * 2 * halfHeight / uViewportHeight.value;
        const [west, east] = [right + left * scale, right + (left + width) * scale], [south, north] = [up + low * scale, up + (low + height) * scale];
        if (east < -halfWidth || west > halfWidth || north < -halfHeight || south > halfHeight) continue;  // Out of sight.
        // Beside the toolbar, or else below it.
        const end = bar ? bar[0] * halfWidth : halfWidth, isWide = east - west > end + halfWidth - 2 * margin;
        const dx = inward(west, east, margin - halfWidth, (isWide ? halfWidth : end) - margin);
        let dy = inward(south, north, margin - halfHeight, halfHeight - margin);
        const across = [(west + dx) / halfWidth, (east + dx) / halfWidth], along = [(south + dy) / halfHeight, (north + dy) / halfHeight];
        const lift = clear(...across, ...along, isWide && bar ? [...placed, bar] : placed);
        placed.push([...across, along[0] + lift, along[1] + lift]);
        dy += lift * halfHeight;
        for (let k = 0; k < 3; k++) data[at + k] += dx * world[k] + dy * world[4 + k];
      }
    }
  };

  const lookAtPage = () => {
    const canvas = document.querySelector("#root canvas[data-engine]"), scene = canvas && canvas.getBoundingClientRect();
    if (!scene || !scene.width) return;
    const edges = (element) => {
      const { left, right, bottom, top, width } = element.getBoundingClientRect();
      return width && [...[left, right].map((x) => (x - scene.left) / scene.width * 2 - 1), ...[bottom, top].map((y) => 1 - (y - scene.top) / scene.height * 2)];
    };
    const toolbar = document.getElementById("rl-toolbar"), isColumn = toolbar && toolbar.offsetHeight > toolbar.offsetWidth;
    bar = isColumn ? edges(toolbar) : null;
    covered = [...document.querySelectorAll(isColumn ? ".rl-scene-legend" : ".rl-scene-legend, #rl-toolbar")].map(edges).filter(Boolean);
  };
  setInterval(() => {
    lookAtPage();
    const nodes = window.__viserMutable && window.__viserMutable.nodeRefFromName;
    const scene = nodes && topOf(Object.values(nodes).find(Boolean));
    if (!scene || (boxes.length && topOf(boxes[0]) === scene)) return;
    boxes = [];
    scene.traverse((node) => { if (isLabels(node)) boxes.push(node); });
    for (const box of boxes) box.onBeforeRender = (renderer, _, camera) => keepInside(camera);
  }, LOOK);
})();
