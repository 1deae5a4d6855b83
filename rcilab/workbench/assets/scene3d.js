// The 3D scene for the other scripts of the page: its place in the window, where a point of it is seen, what is under
// the pointer. viser 1.1 has no public way to its scene; where it is not found as expected, there is nothing to pick.
// Unnecessary once viser gives a page its scene.
(() => {
  "use strict";
  const FLOOR = 2.0;  // [m] Half an edge of the drawn ground.
  const SOLID = /^\/live\/(.*\/)?(base_\w+|shell|cap|dark|carried)$|^\/cell\/obstacle\d+\/mesh$/;  // Nodes of what is solid.
  const viser = () => window.__viserMutable || {};
  const node = (name) => (viser().nodeRefFromName || {})[name];
  const nodes = () => Object.entries(viser().nodeRefFromName || {}).filter(([, object]) => object);
  // State of react-three-fiber: raycaster, camera, and whether objects get pointer events.
  const fiber = () => { const { scene } = viser(), root = scene && scene.__r3f && scene.__r3f.root; return root ? root.getState() : null; };
  const canvas = () => document.querySelector("#root canvas[data-engine]");
  const box = () => { const found = canvas(); return found ? found.getBoundingClientRect() : null; };
  const isShown = (object) => { for (; object; object = object.parent) if (!object.visible) return false; return true; };

  // Where a point in three's coordinates is in the window, [px]; null behind the camera.
  const project = (point) => {
    const { camera } = viser(), scene = box();
    if (point.clone().applyMatrix4(camera.matrixWorldInverse).z >= 0) return null;
    const { x, y } = point.clone().project(camera);
    return [scene.left + (x + 1) / 2 * scene.width, scene.top + (1 - y) / 2 * scene.height];
  };

  // How large 1 m is seen at a point, [px].
  const scale = (point) => {
    const { camera } = viser(), depth = -point.clone().applyMatrix4(camera.matrixWorldInverse).z;
    return depth > 0 ? box().height / 2 * camera.projectionMatrix.elements[5] / depth : 0;
  };

  const floor = (ray) => {
    const base = node("/base_axes"), ground = node("/ground");
    if (!base || !ground || !isShown(ground)) return null;
    const { origin, direction } = ray.clone().applyMatrix4(base.matrixWorld.clone().invert());
    const height = base.worldToLocal(ground.getWorldPosition(origin.clone())).z, distance = (height - origin.z) / direction.z;
    const point = origin.clone().addScaledVector(direction, distance);
    const isHit = distance > 0 && Math.abs(point.x) <= FLOOR && Math.abs(point.y) <= FLOOR;
    return isHit ? { owner: "/ground", object: base, point, normal: origin.clone().set(0, 0, 1), distance } : null;
  };

  // The nearest of arm, obstacles and floor at a place of the window: name of its node, and point and normal in its
  // object's coordinates; null where there is nothing.
  const pick = (x, y) => {
    const state = fiber(), scene = box();
    if (!state || !scene) return null;
    const pointer = state.pointer.clone().set((x - scene.left) / scene.width * 2 - 1, 1 - (y - scene.top) / scene.height * 2);
    const { raycaster } = state;
    raycaster.setFromCamera(pointer, viser().camera);
    const names = new Map(nodes().map(([name, object]) => [object, name]));
    const ownerOf = (object) => { while (object && !names.has(object)) object = object.parent; return names.get(object) || ""; };
    const hit = ["/live", "/cell"].filter(node).flatMap((root) => raycaster.intersectObject(node(root), true))
      .filter(({ object, face }) => face && SOLID.test(ownerOf(object)) && isShown(object))
      .reduce((nearest, next) => (nearest && nearest.distance <= next.distance ? nearest : next), null);
    const ground = floor(raycaster.ray);
    if (ground && (!hit || ground.distance < hit.distance)) return ground;
    return hit && { owner: ownerOf(hit.object), object: hit.object, point: hit.object.worldToLocal(hit.point.clone()), normal: hit.face.normal.clone() };
  };

  // Objects of the scene do not react to the pointer while anything blocks them; the camera always does.
  const blocks = new Set();
  const block = (reason, on) => {
    const state = fiber();
    if (on) blocks.add(reason); else blocks.delete(reason);
    if (state) state.setEvents({ enabled: blocks.size === 0 });
  };
  const stopCamera = () => { const { cameraControl } = viser(); if (cameraControl) cameraControl.cancel(); };
  const isIn = (object) => { while (object && object.parent) object = object.parent; return object === viser().scene; };
  const draw = () => { if (viser().requestRender) viser().requestRender(); };
  window.rcilabScene = { canvas, box, node, nodes, project, scale, pick, block, isIn, isShown, stopCamera, draw };
})();
