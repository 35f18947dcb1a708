// SPDX-License-Identifier: GPL-3.0-or-later
//
// What the viewer of the report page shows, out of the JSON that viewer_scene() writes: the mesh with
// its evidence, and how three.js draws it. Everything is in internal units of the scene.
'use strict';

// `changed` is called whenever a photograph has been decoded.
function viewerScene(scene, changed) {
  function bytes(base64) {
    const text = atob(base64);
    const out = new Uint8Array(text.length);
    for (let i = 0; i < text.length; ++i) out[i] = text.charCodeAt(i);
    return out;
  }
  let pending = 0;  // photographs that the browser has not decoded yet
  const floats = (base64) => new Float32Array(bytes(base64).buffer);

  const vertices = floats(scene.mesh.vertices);
  const faces = new Uint32Array(bytes(scene.mesh.faces).buffer);
  const vertexColors = bytes(scene.mesh.colors);
  const sigmas = floats(scene.mesh.sigma);        // empty: not stated
  const provenance = bytes(scene.mesh.provenance);  // empty: not stated
  const corners = faces.length;
  const vector = (i) => new THREE.Vector3(vertices[3 * i], vertices[3 * i + 1], vertices[3 * i + 2]);
  const statesLabels = provenance.length > 0;
  // Inferred or estimated: nothing measured where it is.
  const withoutEvidence = new Set(scene.labels.filter((l) => !l.has_evidence).map((l) => l.number));
  const isInvented = (face) => statesLabels && withoutEvidence.has(provenance[face]);
  // What is not stated at every corner is not stated between them.
  function statesSigma(face) {
    if (!sigmas.length || isInvented(face)) return false;
    return [0, 1, 2].every((k) => Number.isFinite(sigmas[faces[3 * face + k]]));
  }
  function areaOf(face) {
    const [a, b, c] = [0, 1, 2].map((k) => vector(faces[3 * face + k]));
    return b.sub(a).cross(c.sub(a)).length() / 2;
  }
  function smoothNormals() {
    const out = new Float32Array(vertices.length);
    for (let c = 0; c < corners; c += 3) {
      const a = 3 * faces[c], b = 3 * faces[c + 1], d = 3 * faces[c + 2];
      const ux = vertices[b] - vertices[a], vx = vertices[d] - vertices[a];
      const uy = vertices[b + 1] - vertices[a + 1], vy = vertices[d + 1] - vertices[a + 1];
      const uz = vertices[b + 2] - vertices[a + 2], vz = vertices[d + 2] - vertices[a + 2];
      for (const corner of [a, b, d]) {  // as long as twice the area
        out[corner] += uy * vz - uz * vy;
        out[corner + 1] += uz * vx - ux * vz;
        out[corner + 2] += ux * vy - uy * vx;
      }
    }
    return out;
  }

  // ---- What is drawn ------------------------------------------------------------------------

  const clip = { value: new THREE.Vector4(0, 0, 0, -1) };  // n, d: gone where n.p + d > 0
  const withInvented = { value: 1 };  // 0: surface without evidence is not drawn
  const lit = { value: 0 };       // 0: colours as they are; 1: under a light at the camera
  const textured = { value: 0 };  // 1: photographs where a face has one
  const pixelsPerTangent = { value: 500 };  // of the canvas: how large a thing is at distance 1

  function surfaceMaterial(map) {
    return new THREE.ShaderMaterial({
      side: THREE.DoubleSide,
      uniforms: { clip, withInvented, lit, textured, map: { value: map }, hasMap: { value: map ? 1 : 0 } },
      vertexShader: `
        attribute vec3 paint;
        attribute float invented;
        varying vec3 vPaint, vNormal, vPlace, vEye;
        varying vec2 vUv;
        varying float vInvented;
        void main() {
          vInvented = invented;
          vec4 eye = modelViewMatrix * vec4(position, 1.0);
          vPaint = paint; vNormal = normalMatrix * normal; vPlace = position; vEye = eye.xyz; vUv = uv;
          gl_Position = projectionMatrix * eye;
        }`,
      fragmentShader: `
        uniform vec4 clip;
        uniform float withInvented, lit, textured, hasMap;
        uniform sampler2D map;
        varying vec3 vPaint, vNormal, vPlace, vEye;
        varying vec2 vUv;
        varying float vInvented;
        void main() {
          if (vInvented > withInvented) discard;
          if (dot(clip, vec4(vPlace, 1.0)) > 0.0) discard;
          if (!gl_FrontFacing) {  // the inside of a closed surface: where it is cut
            float hatch = step(mod(gl_FragCoord.x + gl_FragCoord.y, 12.0), 1.5);
            gl_FragColor = vec4(mix(vec3(0.33, 0.37, 0.42), vec3(0.5, 0.54, 0.59), hatch), 1.0);
            return;
          }
          vec3 color = textured * hasMap > 0.5 ? texture2D(map, vUv).rgb : vPaint;
          float toEye = abs(dot(normalize(vNormal), normalize(vEye)));
          gl_FragColor = vec4(color * mix(1.0, 0.35 + 0.65 * toEye, lit), 1.0);
        }`,
    });
  }
  // So large that the points about cover the surface that was seen.
  function pointSize() {
    let area = 0;
    for (let f = 0; f < corners / 3; ++f) if (!isInvented(f)) area += areaOf(f);
    const points = scene.gaussians.positions.length / 16;  // 12 bytes each, in base64
    return 1.5 * Math.sqrt(area / Math.max(1, points));
  }
  function cloudMaterial(size) {
    return new THREE.ShaderMaterial({
      uniforms: { clip, size: { value: size }, pixelsPerTangent },
      vertexShader: `
        attribute vec3 paint;
        uniform float size, pixelsPerTangent;
        varying vec3 vPaint, vPlace;
        void main() {
          vPaint = paint; vPlace = position;
          gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
          gl_PointSize = max(2.0, size * pixelsPerTangent / gl_Position.w);
        }`,
      fragmentShader: `
        uniform vec4 clip;
        varying vec3 vPaint, vPlace;
        void main() {
          if (dot(clip, vec4(vPlace, 1.0)) > 0.0) discard;
          gl_FragColor = vec4(vPaint, 1.0);
        }`,
    });
  }

  // Corners of their own for every face: labels and photographs change from face to face.
  const paint = new THREE.BufferAttribute(new Uint8Array(3 * corners), 3, true);
  const surface = (() => {
    const normals = smoothNormals();
    const place = new Float32Array(3 * corners);
    const normal = new Float32Array(3 * corners);
    const uv = new Float32Array(2 * corners);
    const invented = new Uint8Array(corners);
    for (let c = 0; c < corners; ++c) {
      invented[c] = isInvented(Math.floor(c / 3));
      for (let k = 0; k < 3; ++k) {
        place[3 * c + k] = vertices[3 * faces[c] + k];
        normal[3 * c + k] = normals[3 * faces[c] + k];
      }
    }
    const geometry = new THREE.BufferGeometry();
    const materials = [];
    let begin = 0;
    scene.mesh.faces_of_photograph.forEach((count, i) => {
      const photograph = scene.photographs[i];
      if (photograph && count) writeCoordinates(uv, begin, begin + 3 * count, photograph);
      geometry.addGroup(begin, 3 * count, i);
      materials.push(surfaceMaterial(photograph && count ? loaded(photograph) : null));
      begin += 3 * count;
    });
    geometry.setAttribute('position', new THREE.BufferAttribute(place, 3));
    geometry.setAttribute('normal', new THREE.BufferAttribute(normal, 3));
    geometry.setAttribute('uv', new THREE.BufferAttribute(uv, 2));
    geometry.setAttribute('paint', paint);
    geometry.setAttribute('invented', new THREE.BufferAttribute(invented, 1));
    return new THREE.Mesh(geometry, materials);
  })();
  function writeCoordinates(uv, begin, end, photograph) {
    const shot = photograph.camera;
    const toCamera = new THREE.Matrix4().getInverse(poseOf(shot));
    for (let c = begin; c < end; ++c) {
      const p = vector(faces[c]).applyMatrix4(toCamera);
      uv[2 * c] = (shot.fx * p.x / p.z + shot.cx - photograph.corner[0]) / photograph.size[0];
      uv[2 * c + 1] = (shot.fy * p.y / p.z + shot.cy - photograph.corner[1]) / photograph.size[1];
    }
  }
  function loaded(photograph) {
    const texture = new THREE.Texture(new Image());
    texture.flipY = false;
    texture.generateMipmaps = false;
    texture.minFilter = THREE.LinearFilter;
    texture.image.onload = texture.image.onerror = (event) => {
      texture.needsUpdate = event.type === 'load';
      pending -= 1;
      changed();
    };
    texture.image.src = 'data:image/jpeg;base64,' + photograph.jpeg;
    pending += 1;
    return texture;
  }
  function poseOf(shot) {
    return new THREE.Matrix4().set(...shot.world_from_cam, 0, 0, 0, 1);
  }

  function cloudOf(gaussians, size) {
    const geometry = new THREE.BufferGeometry();
    const places = floats(gaussians.positions);
    geometry.setAttribute('position', new THREE.BufferAttribute(places, 3));
    geometry.setAttribute('paint', new THREE.BufferAttribute(bytes(gaussians.colors), 3, true));
    return new THREE.Points(geometry, cloudMaterial(size));
  }
  const cloud = cloudOf(scene.gaussians, pointSize());
  const fill = cloudOf(scene.fill, scene.fill.size);

  // ---- What it answers ----------------------------------------------------------------------

  // Where a ray first meets what is shown of the surface; null = nowhere, or its inside.
  function firstHit(origin, direction) {
    const { x: dx, y: dy, z: dz } = direction;
    let best = null;
    let front = false;
    let nearest = Infinity;
    for (let c = 0; c < corners; c += 3) {
      if (!withInvented.value && isInvented(c / 3)) continue;
      const a = 3 * faces[c], b = 3 * faces[c + 1], d = 3 * faces[c + 2];
      const ax = vertices[a], ay = vertices[a + 1], az = vertices[a + 2];
      const ux = vertices[b] - ax, uy = vertices[b + 1] - ay, uz = vertices[b + 2] - az;
      const vx = vertices[d] - ax, vy = vertices[d + 1] - ay, vz = vertices[d + 2] - az;
      const px = dy * vz - dz * vy, py = dz * vx - dx * vz, pz = dx * vy - dy * vx;
      const det = ux * px + uy * py + uz * pz;
      if (det === 0) continue;
      const tx = origin.x - ax, ty = origin.y - ay, tz = origin.z - az;
      const s = (tx * px + ty * py + tz * pz) / det;
      if (s < 0 || s > 1) continue;
      const qx = ty * uz - tz * uy, qy = tz * ux - tx * uz, qz = tx * uy - ty * ux;
      const t = (dx * qx + dy * qy + dz * qz) / det;
      if (t < 0 || s + t > 1) continue;
      const distance = (vx * qx + vy * qy + vz * qz) / det;
      if (distance <= 0 || distance >= nearest) continue;
      const place = new THREE.Vector3(ax + s * ux + t * vx, ay + s * uy + t * vy, az + s * uz + t * vz);
      const { x, y, z, w } = clip.value;
      if (x * place.x + y * place.y + z * place.z + w > 0) continue;
      nearest = distance;
      front = det > 0;
      best = { place, distance, face: c / 3, weights: [1 - s - t, s, t] };
    }
    return front ? best : null;
  }

  // Standard deviation at a point of a face, in internal units; NaN = no statement.
  function sigmaAt({ face, weights }) {
    if (!sigmas.length || isInvented(face)) return NaN;
    return weights.reduce((sum, weight, k) => (weight > 0 ? sum + weight * sigmas[faces[3 * face + k]] : sum), 0);
  }
  // The same along the line between two ends, by the formula of cgs measure.
  function sigmaAlong(end, other) {
    const [a, b, c] = [0, 1, 2].map((k) => vector(faces[3 * end.face + k]));
    const normal = b.sub(a).cross(c.sub(a)).normalize();
    const cosine = normal.dot(other.place.clone().sub(end.place).normalize());
    const tangential = 0.65;
    return sigmaAt(end) * Math.sqrt(tangential ** 2 + (1 - tangential ** 2) * cosine ** 2);
  }
  return {
    vertices, faces, vertexColors, sigmas, provenance, statesLabels, corners,
    vector, isInvented, statesSigma, areaOf, poseOf, firstHit, sigmaAt, sigmaAlong,
    surface, paint, cloud, fill, clip, withInvented, lit, textured, pixelsPerTangent,
    isComplete: () => pending === 0,
  };
}
