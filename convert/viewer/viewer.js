// SPDX-License-Identifier: GPL-3.0-or-later
//
// The viewer of the report page: fills the markup of viewer.html and acts on mouse, touch and keys.
// Everything is in internal units of the scene; what people read is in coordinates of the files, as
// `cgs measure` takes them, and in the unit of figures.
'use strict';
(() => {
  let asked = false;  // for a picture
  const part = (id) => document.getElementById('viewer-' + id);
  const root = document.getElementById('viewer');
  const canvas = part('canvas');
  const context = canvas.getContext('webgl', { antialias: true, alpha: true });
  const fail = () => { root.dataset.state ||= 'failed'; };  // but for what fails once it runs
  if (!context || context.isContextLost()) return fail();
  window.addEventListener('error', fail);

  const scene = JSON.parse(document.getElementById('viewer-scene').textContent);
  const {
    vertices, faces, vertexColors, sigmas, provenance, statesLabels, corners,
    vector, isInvented, statesSigma, areaOf, poseOf, firstHit, sigmaAt, sigmaAlong,
    surface, paint, cloud, fill, clip, withInvented, lit, textured, pixelsPerTangent, isComplete,
  } = viewerScene(scene, () => redraw());

  const renderer = new THREE.WebGLRenderer({ canvas, context, antialias: true, alpha: true });
  canvas.addEventListener('webglcontextrestored', () => redraw());  // after what the renderer does
  const world = new THREE.Scene();
  const camera = new THREE.PerspectiveCamera(45, 1, 0.002, 40);
  camera.up.fromArray(scene.up).normalize();

  const between = new THREE.Line(
    new THREE.BufferGeometry().setFromPoints([new THREE.Vector3(), new THREE.Vector3()]),
    new THREE.LineBasicMaterial({ color: 0xf21ad9, depthTest: false, transparent: true }));
  for (const object of [surface, cloud, fill, between]) object.frustumCulled = false;
  world.add(surface, cloud, fill, between);

  // ---- The camera ---------------------------------------------------------------------------

  const controls = new THREE.OrbitControls(camera, canvas);
  controls.enableKeys = false;
  controls.screenSpacePanning = true;
  controls.enableZoom = false;  // until the canvas has the focus: the wheel belongs to the page
  controls.addEventListener('change', redraw);
  canvas.addEventListener('focus', () => { controls.enableZoom = true; });
  canvas.addEventListener('blur', () => { controls.enableZoom = false; });

  const pixelRatio = () => Math.min(window.devicePixelRatio, 2);
  let lens = null;  // of the photograph whose place was taken; null = our own
  function applyLens() {
    const width = canvas.parentElement.clientWidth;
    const height = canvas.parentElement.clientHeight;
    renderer.setPixelRatio(pixelRatio());
    renderer.setSize(width, height, false);
    camera.fov = 45;
    camera.aspect = width / height;
    camera.clearViewOffset();
    if (lens) {  // as large as it fits, its principal point where it belongs
      const scale = Math.min(width / lens.width, height / lens.height);
      camera.fov = 2 * Math.atan(height / 2 / (lens.fy * scale)) * 180 / Math.PI;
      camera.setViewOffset(width, height, (lens.width / 2 - lens.cx) * scale,
        (lens.height / 2 - lens.cy) * scale, width, height);
      camera.aspect *= lens.fy / lens.fx;
    }
    camera.updateProjectionMatrix();
    pixelsPerTangent.value = renderer.getPixelRatio() * height / 2 * camera.projectionMatrix.elements[5];
    redraw();
  }

  const forwardOf = (shot) => new THREE.Vector3(0, 0, 1).transformDirection(poseOf(shot));

  // The vertices that are not on invented faces alone; all, if there are no others.
  function seenVertices() {
    const seen = new Uint8Array(vertices.length / 3);
    for (let c = 0; c < corners; ++c) if (!isInvented(Math.floor(c / 3))) seen[faces[c]] = 1;
    const all = Array.from(seen.keys());
    const some = all.filter((v) => seen[v]);
    return (some.length ? some : all).map(vector);
  }

  // From the side of the middle photograph, as far away as shows all that was seen, in the middle.
  function standBack() {
    lens = null;
    applyLens();
    const middle = scene.cameras[scene.cameras.length >> 1].camera;
    const forward = forwardOf(middle);
    const steepness = forward.dot(camera.up);
    if (Math.abs(steepness) > 0.95) {  // from above or below, the photograph says which side is up
      const upright = new THREE.Vector3(0, -1, 0).transformDirection(poseOf(middle));
      forward.addScaledVector(upright, -0.2 * Math.sign(steepness)).normalize();
    }
    const points = seenVertices();
    const target = new THREE.Box3().setFromPoints(points).getCenter(new THREE.Vector3());
    camera.position.copy(target).sub(forward);
    camera.lookAt(target);
    const toCamera = camera.quaternion.clone().inverse();
    for (const p of points) p.sub(target).applyQuaternion(toCamera);
    const tanY = 0.95 * Math.tan(camera.fov * Math.PI / 360);
    const tanX = tanY * camera.aspect;
    const shift = new THREE.Vector3();
    let distance = 0;
    for (let round = 0; round < 3; ++round) {  // moving sideways changes how far away is enough
      distance = 0;
      for (const p of points) {
        distance = Math.max(distance, Math.abs(p.x - shift.x) / tanX + p.z, Math.abs(p.y - shift.y) / tanY + p.z);
      }
      const onScreen = new THREE.Box2();
      for (const p of points) {
        const depth = distance - p.z;
        onScreen.expandByPoint(new THREE.Vector2((p.x - shift.x) / depth, (p.y - shift.y) / depth));
      }
      const center = onScreen.getCenter(new THREE.Vector2()).multiplyScalar(distance);
      if (round < 2) shift.add(new THREE.Vector3(center.x, center.y, 0));
    }
    target.add(shift.applyQuaternion(camera.quaternion));
    camera.position.copy(target).addScaledVector(forward, -distance);
    controls.target.copy(target);
    controls.update();
  }

  // Exactly as the photograph was taken; the first turn makes up upright again.
  function standAt(shot) {
    lens = shot;
    applyLens();
    const pose = poseOf(shot).multiply(new THREE.Matrix4().makeScale(1, -1, -1));
    pose.decompose(camera.position, camera.quaternion, new THREE.Vector3());
    const hit = firstHit(camera.position, forwardOf(shot));
    controls.target.copy(camera.position).addScaledVector(forwardOf(shot), hit ? hit.distance : 0.5);
    redraw();
  }

  function turn(byLongitude, byLatitude) {
    const upright = new THREE.Quaternion().setFromUnitVectors(camera.up, new THREE.Vector3(0, 1, 0));
    const offset = camera.position.clone().sub(controls.target).applyQuaternion(upright);
    const place = new THREE.Spherical().setFromVector3(offset);
    place.theta += byLongitude;
    place.phi += byLatitude;
    offset.setFromSpherical(place.makeSafe()).applyQuaternion(upright.inverse());
    camera.position.copy(controls.target).add(offset);
    controls.update();
  }
  function zoom(factor) {
    camera.position.sub(controls.target).multiplyScalar(factor).add(controls.target);
    controls.update();
  }

  // ---- Looks --------------------------------------------------------------------------------

  const unknownColor = [128, 128, 128];
  const ramp = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];
  const nameOf = {};
  const looksOfLabel = {};
  for (const label of scene.labels) {
    nameOf[label.number] = label.name;
    looksOfLabel[label.number] = label.color;
  }

  // Two digits that count, without an exponent.
  function rounded(value, digits = 2) {
    const decimals = digits - 1 - Math.floor(Math.log10(value));
    if (!Number.isFinite(decimals)) return String(value);
    const unit = 10 ** -decimals;
    return decimals < 0 ? String(Math.round(value / unit) * unit) : value.toFixed(Math.min(decimals, 12));
  }
  const share = (value) => rounded(100 * value, value < 0.1 ? 2 : 3) + ' %';
  const [leastSigma, mostSigma] = (() => {  // what all but the extreme 2 % lie between
    const stated = sigmas.filter((s) => s > 0 && Number.isFinite(s)).sort();
    const at = (part) => stated[Math.floor(part * (stated.length - 1))] || 1e-9;
    return [at(0.02), Math.max(at(0.98), 1.01 * at(0.02))];
  })();
  const onSigmaScale = (s) => Math.log(s / leastSigma) / Math.log(mostSigma / leastSigma);

  function paintEach(colorOf) {
    for (let c = 0; c < corners; ++c) {
      const color = colorOf(c);
      for (let k = 0; k < 3; ++k) paint.array[3 * c + k] = color[k];
    }
    paint.needsUpdate = true;
  }
  function rampColor(t) {
    const at = Math.min(Math.max(t, 0), 1) * (ramp.length - 1);
    const i = Math.min(Math.floor(at), ramp.length - 2);
    return ramp[i].map((low, k) => low + (ramp[i + 1][k] - low) * (at - i));
  }
  const vertexPalette = Array.from({ length: vertexColors.length / 3 }, (_, v) => vertexColors.subarray(3 * v, 3 * v + 3));
  const colorOfVertex = (c) => vertexPalette[faces[c]] || [190, 190, 190];

  const legend = part('legend');
  function explain(color, text) {
    const entry = document.createElement('span');
    const swatch = document.createElement('i');
    swatch.style.background = `rgb(${color})`;
    entry.append(swatch, text);
    legend.append(entry);
  }
  function explainLabels() {
    const area = {};
    let all = 0;
    for (let f = 0; f < provenance.length; ++f) {
      area[provenance[f]] = (area[provenance[f]] || 0) + areaOf(f);
      all += areaOf(f);
    }
    for (const { number, name, meaning } of scene.labels) {
      const part = area[number] ? share(area[number] / all) + ' of the area' : 'none';
      explain(looksOfLabel[number], `${name} (${meaning}): ${part}`);
    }
  }
  function explainSigma() {
    const bar = document.createElement('i');
    bar.className = 'ramp';
    bar.style.background = `linear-gradient(to right, ${ramp.map((c) => `rgb(${c})`)})`;
    const line = document.createElement('span');
    const text = (s) => `${rounded(s * scene.unit.length)} ${scene.unit.name}`;
    line.append(`standard deviation ${text(leastSigma)} or less`, bar, `${text(mostSigma)} or more (logarithmic)`);
    legend.append(line);
    explain(unknownColor, 'unknown: inferred or estimated, nothing measured it');
  }

  const fillHoles = part('fill');
  const isFilled = () => scene.fill.count > 0 && fillHoles.getAttribute('aria-pressed') === 'true';
  const looks = [
    { name: 'Photographs', there: scene.photographs.length > 0, lit: 0, textured: 1, paint: colorOfVertex,
      explain: () => legend.append('Every face shows the photograph that sees it best; what none shows has the colours around it.') },
    { name: 'Colour', there: true, lit: 0.6, paint: colorOfVertex,
      explain: () => legend.append('Colours of the vertices, under a light at the camera.') },
    { name: 'Provenance', there: statesLabels, lit: 0.7, explain: explainLabels,
      paint: (c) => looksOfLabel[provenance[Math.floor(c / 3)]] },
    { name: 'Sigma', there: sigmas.length > 0, lit: 0.5, explain: explainSigma,
      paint: (c) => (statesSigma(Math.floor(c / 3)) ? rampColor(onSigmaScale(sigmas[faces[c]])) : unknownColor) },
    { name: 'Gaussians', there: scene.gaussians.count > 0, points: true,
      explain: () => legend.append(`${cloud.geometry.attributes.position.count} of ${scene.gaussians.count} Gaussians, as points of their colour, all of one size and opaque. Measuring needs the surface.` +
        (isFilled() ? ` Their holes are filled with ${scene.fill.count} synthetic ones, which no photograph shows.` : '')) },
  ].filter((look) => look.there);

  function show(look) {
    surface.visible = !look.points;
    cloud.visible = !surface.visible;
    fill.visible = cloud.visible && isFilled();
    fillHoles.hidden = surface.visible || scene.fill.count === 0;
    lit.value = look.lit || 0;
    textured.value = look.textured || 0;
    if (look.paint) paintEach(look.paint);
    legend.textContent = '';
    look.explain();
    for (const other of looks) other.button.setAttribute('aria-pressed', other === look);
    redraw();
  }

  function button(group, text, act) {
    const out = document.createElement('button');
    out.type = 'button';
    out.textContent = text;
    out.addEventListener('click', act);
    part(group).append(out);
    return out;
  }

  // ---- Measuring ----------------------------------------------------------------------------

  // With so many significant digits of the scene's size.
  function toFile(place, digits = 8) {
    const decimals = Math.min(Math.max(0, digits - 1 - Math.floor(Math.log10(scene.file.scale))), 100);
    return place.toArray().map((value, k) => (scene.file.origin[k] + scene.file.scale * value).toFixed(decimals));
  }
  // Two digits of sigma decide how many the value has.
  function withSigma(value, sigma) {
    const stated = Number.isFinite(sigma) && sigma > 0;
    const decimals = stated ? 1 - Math.floor(Math.log10(sigma)) : 3 - Math.floor(Math.log10(value || 1));
    const text = (x) => x.toFixed(Math.min(Math.max(decimals, 0), 12));
    return stated ? `${text(value)} ± ${text(sigma)} ${scene.unit.name}` : `${text(value)} ${scene.unit.name}`;
  }

  const measured = part('measured');
  let ends = [];
  function line(tag, text) {
    const out = document.createElement(tag);
    out.textContent = text;
    const paragraph = document.createElement('p');
    paragraph.append(out);
    measured.append(paragraph);
  }
  function describe(name, end) {
    const sigma = sigmaAt(end);
    const label = statesLabels ? nameOf[provenance[end.face]] : 'provenance not stated';
    let text = `${name} (${toFile(end.place).join(', ')}): ${label}`;
    if (isInvented(end.face)) text += '. Nothing measured this place: it has no sigma';
    else if (Number.isFinite(sigma)) text += `, ± ${rounded(sigma * scene.unit.length)} ${scene.unit.name}`;
    else text += ', no sigma stated';
    line('span', text + '.');
  }
  function tell() {
    measured.textContent = '';
    between.visible = ends.length === 2;
    if (ends.length < 2) line('span', ends.length ? 'Pick the second point.' : 'Pick two points to measure their distance.');
    if (ends.length === 2) {
      const [a, b] = ends;
      between.geometry.setFromPoints([a.place, b.place]);
      const value = a.place.distanceTo(b.place) * scene.unit.length;
      const own = Math.hypot(sigmaAlong(a, b), sigmaAlong(b, a)) * scene.unit.length;
      const sigma = Math.hypot(own, value * scene.unit.sigma);
      line('strong', `Distance ${withSigma(value, sigma)}`);
      if (!Number.isFinite(sigma)) line('span', 'This distance has no sigma: an end of it has none.');
      if (scene.unit.name === 'units') line('span', 'The scale of the scene is unknown: units are those of the files.');
    }
    ends.forEach((end, i) => describe('AB'[i], end));
    if (ends.length === 2) {
      line('code', 'cgs measure mesh/watertight.ply --distance ' + ends.map((end) => toFile(end.place).join()).join(' '));
    }
    redraw();
  }
  function clearEnds() {
    for (const end of ends) end.mark.remove();
    ends = [];
    tell();
  }
  function pick(x, y) {  // in [-1, 1]
    if (!surface.visible) return;
    camera.updateMatrixWorld();
    const direction = new THREE.Vector3(x, y, 0.5).unproject(camera).sub(camera.position).normalize();
    const hit = firstHit(camera.position, direction);
    if (!hit) return;
    if (ends.length === 2) clearEnds();
    hit.mark = document.createElement('div');
    hit.mark.className = 'end' + (isInvented(hit.face) ? ' invented' : '');
    hit.mark.setAttribute('aria-hidden', 'true');
    hit.mark.append(document.createElement('span'));
    hit.mark.firstChild.textContent = 'AB'[ends.length];
    canvas.parentElement.append(hit.mark);
    ends.push(hit);
    tell();
  }
  function placeMarks() {
    const size = renderer.getSize(new THREE.Vector2());
    for (const end of ends) {
      const p = end.place.clone().project(camera);
      end.mark.hidden = p.z > 1;
      end.mark.style.transform = `translate(${(p.x + 1) / 2 * size.x}px, ${(1 - p.y) / 2 * size.y}px)`;
    }
  }

  // ---- Section ------------------------------------------------------------------------------

  const axis = part('axis');
  const cut = part('cut');
  const side = part('side');
  const bounds = new THREE.Box3().setFromArray(vertices);
  function section() {
    const name = axis.value;
    cut.disabled = side.disabled = !name;
    const text = part('cut-text');
    text.textContent = '';
    clip.value.set(0, 0, 0, -1);
    if (name) {
      const sign = side.getAttribute('aria-pressed') === 'true' ? -1 : 1;
      const at = bounds.min[name] + (bounds.max[name] - bounds.min[name]) * cut.value / 1000;
      clip.value.set(0, 0, 0, -sign * at)[name] = sign;
      text.textContent = `${name} = ${toFile(new THREE.Vector3(at, at, at), 4)['xyz'.indexOf(name)]}`;
      cut.setAttribute('aria-valuetext', text.textContent);
    }
    redraw();
  }
  window.addEventListener('pageshow', section);  // browsers bring back what was set before
  axis.addEventListener('change', section);
  cut.addEventListener('input', section);
  side.addEventListener('click', () => {
    side.setAttribute('aria-pressed', side.getAttribute('aria-pressed') !== 'true');
    section();
  });

  // ---- Surface without evidence -------------------------------------------------------------

  const invented = part('invented');
  invented.hidden = !provenance.some((_, face) => isInvented(face));
  invented.addEventListener('click', () => {
    withInvented.value = 1 - withInvented.value;
    invented.setAttribute('aria-pressed', withInvented.value === 1);
    redraw();
  });

  // ---- Holes of the Gaussians, filled and not -----------------------------------------------

  fillHoles.addEventListener('click', () => {
    fillHoles.setAttribute('aria-pressed', !isFilled());
    show(looks.find((look) => look.points));
  });

  // ---- Mouse, touch and keys ----------------------------------------------------------------

  let pressed = null;
  canvas.addEventListener('pointerdown', (event) => {
    pressed = event.isPrimary && event.button === 0 ? event : null;
    controls.enableZoom = true;
  });
  canvas.addEventListener('pointerup', (event) => {
    const still = pressed && Math.hypot(event.clientX - pressed.clientX, event.clientY - pressed.clientY) < 5;
    pressed = null;
    if (!still) return;
    const frame = canvas.getBoundingClientRect();
    pick((event.clientX - frame.left) / frame.width * 2 - 1, 1 - (event.clientY - frame.top) / frame.height * 2);
  });
  const STEP = Math.PI / 36;
  const keys = {
    ArrowLeft: () => turn(-STEP, 0), ArrowRight: () => turn(STEP, 0),
    ArrowUp: () => turn(0, -STEP), ArrowDown: () => turn(0, STEP),
    '+': () => zoom(0.9), '=': () => zoom(0.9), '-': () => zoom(1 / 0.9),
    Enter: () => pick(0, 0), Escape: clearEnds, h: () => invented.click(),
    f: () => { if (!fillHoles.hidden) fillHoles.click(); },
  };
  canvas.addEventListener('keydown', (event) => {
    const act = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (event.ctrlKey || event.altKey || event.metaKey || !act) return;
    event.preventDefault();
    act();
  });

  // ---- Drawing ------------------------------------------------------------------------------

  function redraw() {
    if (asked) return;
    asked = true;
    requestAnimationFrame(() => {
      asked = false;
      if (!isComplete()) return;  // the last photograph asks again
      if (renderer.getPixelRatio() !== pixelRatio()) return applyLens();  // on another screen now
      renderer.render(world, camera);
      placeMarks();
      if (root.dataset.state) return;
      root.dataset.state = 'ready';
      root.dataset.milliseconds = Math.round(performance.now());  // since the page was asked for
    });
  }

  for (const look of looks) look.button = button('looks', look.name, () => show(look));
  button('places', 'All', standBack);
  for (const { name, camera: shot } of scene.cameras) button('places', name, () => standAt(shot));
  show(looks[0]);
  clearEnds();
  standBack();
  new ResizeObserver(applyLens).observe(canvas.parentElement);
  window.addEventListener('resize', redraw);
  window.addEventListener('beforeprint', () => renderer.render(world, camera));  // kept till then
})();
