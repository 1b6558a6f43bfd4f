// Bodies in space: drag turns, shift or right button moves, wheel or two fingers zoom. In the plane drag moves.
(() => {
  const data = JSON.parse(document.getElementById("view").textContent);
  const figure = document.getElementById("bodies"), canvas = figure.querySelector("canvas");
  const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
  if (!gl) {
    canvas.replaceWith("This browser shows no WebGL 2. A run with --vtu writes bodies.pvd for ParaView.");
    return;
  }
  const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer;
  const rgb = color => [1, 3, 5].map(k => parseInt(color.slice(k, k + 2), 16) / 255);
  const program = twgl.createProgramInfo(gl, [`#version 300 es
    in vec3 point, displacement; in float value, known;
    uniform mat4 view; uniform float scale, travels; uniform vec2 travel; uniform vec3 nudge;
    // the value, and the share of nodes that have one
    out vec2 shade; out vec3 place;
    void main() {
      place = point + scale * displacement;
      float far = (length(displacement) - travel.x) / (travel.y - travel.x);
      shade = travels > 0.5 ? vec2(far, 1.0) : vec2(value * 65535.0 / 65534.0, known);
      gl_Position = view * vec4(place, 1.0) + vec4(nudge, 0.0);
      gl_PointSize = 9.0;
    }`, `#version 300 es
    precision highp float;
    in vec2 shade; in vec3 place; out vec4 color;
    uniform vec3 colors[12], toward; uniform vec4 cut, ink; uniform vec2 ends; uniform float squares, opens;
    void main() {
      if (dot(place, cut.xyz) > cut.w) discard;
      vec3 normal = normalize(cross(dFdx(place), dFdy(place)));
      float light = 0.55 + 0.45 * abs(dot(normal, toward));
      // nodes without a value take part in none: the others alone make it
      float value = shade.x / max(shade.y, 1e-6);
      float share = max((value - ends.x) / (ends.y - ends.x), 0.0);
      int band = clamp(int((squares > 0.5 ? sqrt(share) : share) * 12.0), 0, 11);
      // beyond a section the inner side of the surface is seen, which is grey like points without a value
      bool inner = cut.xyz != vec3(0.0) && !gl_FrontFacing;
      bool none = shade.y < 0.5 || (opens > 0.5 && value < 0.5 / 65534.0);
      vec3 paint = inner || none ? vec3(0.72) : ink.a > 0.0 ? ink.rgb : colors[band];
      // lines and points, whose ink is opaque, have no light
      color = ink.a == 1.0 ? ink : vec4(paint * light, 1.0);
    }`]);
  // the edges that belong to one triangle alone
  const rim = (triangles, points) => {
    const edges = new Map();
    triangles.forEach((from, k) => {
      const to = triangles[k % 3 === 2 ? k - 2 : k + 1];
      const edge = Math.min(from, to) * points + Math.max(from, to);
      edges.has(edge) ? edges.delete(edge) : edges.set(edge, [from, to]);
    });
    return new Uint32Array([...edges.values()].flat());
  };
  const part = (part, kind) => {
    const arrays = {
      point: { numComponents: 3, data: new Float32Array(bytes(part.points)) },
      displacement: { numComponents: 3, data: new Float32Array(bytes(part.displacement)) },
      indices: new Uint32Array(bytes(part.triangles)),
    };
    const made = more => twgl.createBufferInfoFromArrays(gl, { ...arrays, ...more });
    const field = text => {
      const values = new Uint16Array(bytes(text)), known = Uint8Array.from(values, v => v === 65535 ? 0 : 255);
      const value = { numComponents: 1, data: values.map(v => v === 65535 ? 0 : v), normalize: true };
      return { values, buffer: made({ value, known: { numComponents: 1, data: known, normalize: true } }) };
    };
    const fields = { value: field(part.value), opening: part.opening ? field(part.opening) : null };
    const indices = list => list.length ? made({ indices: list }) : null;
    // bodies in the plane have outlines
    const outline = indices(data.space ? [] : rim(arrays.indices, arrays.point.data.length / 3));
    const marks = part.marks.map(([role, kinds]) => ({ role, buffers: kinds.map(kind => indices(new Uint32Array(bytes(kind)))) }));
    return { kind, name: part.name, body: part.body, shown: true, fields, outline, arrays, marks };
  };
  const parts = [...data.bodies.map(b => part(b, "body")), ...data.surfaces.map(s => part(s, "surface"))];
  const middle = data.low.map((low, k) => (low + data.high[k]) / 2);
  const size = Math.hypot(...data.low.map((low, k) => data.high[k] - low)) || 1;
  const colors = data.colors.flatMap(rgb), roles = Object.fromEntries(data.roles.map(([role, , color]) => [role, rgb(color)]));
  const eye = {};
  const reset = () => {
    const [turn, rise] = data.space ? [-0.9, 0.45] : [-Math.PI / 2, Math.PI / 2], aspect = canvas.clientWidth / canvas.clientHeight || 1;
    // half of the box along a direction, and a tenth more for displacements
    const half = v => 0.55 * data.low.reduce((sum, low, k) => sum + Math.abs(v[k]) * (data.high[k] - low), 0);
    const right = half([Math.sin(turn), Math.cos(turn), 0]);
    const up = half([Math.sin(rise) * Math.cos(turn), Math.sin(rise) * Math.sin(turn), Math.cos(rise)]);
    const fits = aspect > 1 ? Math.max(up, right / aspect) : Math.max(right, up * aspect);
    Object.assign(eye, { turn, rise, zoom: 0.5 * size / fits || 1, right: 0, up: 0 });
  };
  const [what, across] = figure.querySelectorAll("select"), [scale, depth] = figure.querySelectorAll("input[type=range]");
  const typed = figure.querySelectorAll("input[type=number]"), [again, save] = figure.querySelectorAll("button");
  // fields of contact surfaces; all others are those of bodies
  const ofContact = () => what.value === "pressure" || what.value === "opening";
  const isDrawn = part => part.shown && ofContact() === (part.kind === "surface");
  const fieldOf = part => part.fields[what.value === "opening" ? "opening" : "value"];
  // the smallest and the largest value, and the ends of the colours: those that were typed, or these; places have no values
  const range = () => data[what.value] ?? [0, 1];
  const ends = () => {
    const own = [...typed].map((input, k) => input.value.trim() === "" || !Number.isFinite(+input.value) ? range()[k] : +input.value);
    return own[0] < own[1] ? own : range();
  };
  const shown = figure.querySelector("output"), bar = figure.querySelector(".bar");
  const factor = () => scale.value / 50 * data.scale;
  // the plane of the section: what lies beyond it along x, y or z is not drawn
  const section = () => {
    const k = ["x", "y", "z"].indexOf(across?.value);
    const normal = [0, 1, 2].map(axis => axis === k ? 1 : 0);
    return [...normal, k < 0 ? 1 : data.low[k] + depth.value / 100 * (data.high[k] - data.low[k])];
  };
  const number = v => Number(v.toPrecision(3)).toString();
  const axes = figure.querySelector(".axes"), under = figure.querySelector(".under");
  // in the plane no axis points to the left or down
  if (!data.space) axes.setAttribute("viewBox", "-12 -68 80 80");

  let waiting = false;
  const redraw = () => { if (!waiting) { waiting = true; requestAnimationFrame(draw); } };
  function draw() {
    waiting = false;
    twgl.resizeCanvasToDisplaySize(canvas, window.devicePixelRatio || 1);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    const m4 = twgl.m4, aspect = canvas.width / canvas.height, half = 0.5 * size / eye.zoom;
    const [w, h] = aspect > 1 ? [half * aspect, half] : [half, half / aspect];
    const toward = [Math.cos(eye.rise) * Math.cos(eye.turn), Math.cos(eye.rise) * Math.sin(eye.turn), Math.sin(eye.rise)];
    const camera = m4.lookAt(middle.map((x, k) => x + 2 * size * toward[k]), middle, data.space ? [0, 0, 1] : [0, 1, 0]);
    const flat = m4.ortho(eye.right - w, eye.right + w, eye.up - h, eye.up + h, -20 * size, 40 * size);
    const look = m4.inverse(camera);
    eye.view = m4.multiply(flat, look);
    // the directions of x, y and z on the screen
    axes.innerHTML = ["x", "y", "z"].slice(0, data.space ? 3 : 2).map((name, k) => {
      const [right, up] = [look[4 * k], -look[4 * k + 1]];
      return `<line x2="${22 * right}" y2="${22 * up}"/><text x="${31 * right}" y="${31 * up}">${name}</text>`;
    }).join("");
    gl.useProgram(program.program);
    const [low, high] = range(), isPlaces = what.value === "places";
    // the colour of the text around
    const ink = [...getComputedStyle(figure).color.match(/\d+/g).slice(0, 3).map(part => part / 255), 1];
    const lit = { view: eye.view, toward, colors, cut: section(), scale: factor(), travel: data.travel, nudge: [0, 0, 0] };
    const shares = ends().map(end => (end - low) / (high - low));
    const draw = (buffer, uniforms, kind) => {
      twgl.setBuffersAndAttributes(gl, program, buffer);
      twgl.setUniforms(program, uniforms);
      twgl.drawBufferInfo(gl, buffer, kind);
    };
    for (const part of parts.filter(isDrawn)) {
      const [travels, squares] = ["travel", "stress"].map(value => what.value === value ? 1 : 0);
      const plain = isPlaces ? [0.82, 0.84, 0.87, 0.5] : [0, 0, 0, 0];
      draw(fieldOf(part).buffer, { ...lit, ends: shares, travels, squares, opens: ofContact() ? 1 : 0, ink: plain });
      if (part.outline) draw(part.outline, { ink }, gl.LINES);
      if (isPlaces) drawPlaces(part, draw);
    }
    shown.textContent = "× " + number(factor());
  }
  // lines are drawn beside each other to be as wide as five pixels, and all places lie a little before their surfaces
  function drawPlaces(part, draw) {
    const before = -1e-4, [right, up] = [2 / canvas.width, 2 / canvas.height], wide = [-2, -1, 0, 1, 2];
    for (const { role, buffers: [triangles, lines, points] } of part.marks) {
      if (triangles) draw(triangles, { ink: [...roles[role], 0.5], nudge: [0, 0, before] });
      const ink = [...roles[role], 1];
      for (const [x, y] of lines ? wide.flatMap(x => wide.map(y => [x, y])) : [])
        draw(lines, { ink, nudge: [x * right, y * up, before] }, gl.LINES);
      if (points) draw(points, { ink, nudge: [0, 0, 2 * before] }, gl.POINTS);
    }
  }
  // the colours below the picture, with the values at which they begin, or with what has them
  function legend() {
    const [low, high] = ends(), isPlaces = what.value === "places";
    const cell = (text, color) => {
      const cell = document.createElement("span");
      color ? cell.style.background = color : cell.className = "end";
      cell.textContent = text;
      return cell;
    };
    const begin = k => low + (high - low) * (what.value === "stress" ? (k / 12) ** 2 : k / 12);
    const cells = data.colors.map((color, k) => cell(k % 3 ? "" : number(begin(k)), color));
    const none = what.value === "opening" ? "closed" : "open: no pressure";
    bar.replaceChildren(...isPlaces ? data.roles.map(([, text, color]) => cell(text, color))
      : [...cells, cell("to " + number(high)), ...ofContact() ? [cell(none, "#b8b8b8")] : []]);
    bar.classList.toggle("roles", isPlaces);
    typed.forEach((input, k) => { input.placeholder = number(range()[k]); input.disabled = isPlaces; });
    if (depth) depth.hidden = !across.value;
    redraw();
  }
  // the picture with its colours as a file
  function savePicture() {
    draw();
    const picture = document.createElement("canvas"), pen = picture.getContext("2d"), box = bar.getBoundingClientRect();
    const ratio = canvas.width / canvas.clientWidth, line = 24 * ratio;
    [picture.width, picture.height] = [canvas.width, canvas.height + line + box.height * ratio];
    pen.fillStyle = "#fff";
    pen.fillRect(0, 0, picture.width, picture.height);
    pen.drawImage(canvas, 0, 0);
    pen.font = `${12 * ratio}px sans-serif`;
    pen.fillStyle = "#000";
    pen.fillText(`${document.title}: ${what.selectedOptions[0].text}`, 4 * ratio, canvas.height + 16 * ratio);
    const at = cell => [cell.getBoundingClientRect()].map(b => [(b.left - box.left) * ratio, canvas.height + line + (b.top - box.top) * ratio, b.width * ratio, b.height * ratio])[0];
    for (const cell of bar.children) if (cell.style.background) { pen.fillStyle = cell.style.background; pen.fillRect(...at(cell)); }
    for (const cell of bar.children) {
      const [x, y] = at(cell);
      pen.fillStyle = cell.style.background ? "#fff" : "#000";
      pen.fillText(cell.textContent, x + 2 * ratio, y + 15 * ratio);
    }
    const link = document.createElement("a");
    link.download = `${document.title}.png`;
    link.href = picture.toDataURL();
    link.click();
  }

  // the nearest point of what is drawn at a place of the picture (-1 to 1 to the right and up): its part, its place before deformation and its value
  const hit = (right, up) => {
    const cut = section(), times = factor(), view = eye.view;
    let best = null;
    for (const part of parts.filter(isDrawn)) {
      const { point: { data: points }, displacement: { data: moves }, indices } = part.arrays;
      const count = points.length / 3, screen = new Float64Array(3 * count);
      const moved = (node, k) => points[3 * node + k] + times * moves[3 * node + k];
      for (let node = 0; node < count; node++)
        for (let row = 0; row < 3; row++)
          screen[3 * node + row] = view[row] * moved(node, 0) + view[4 + row] * moved(node, 1) + view[8 + row] * moved(node, 2) + view[12 + row];
      for (let t = 0; t < indices.length; t += 3) {
        const nodes = indices.subarray(t, t + 3), [a, b, c] = nodes;
        const [ax, ay] = [screen[3 * a], screen[3 * a + 1]];
        const [bx, by, cx, cy] = [screen[3 * b] - ax, screen[3 * b + 1] - ay, screen[3 * c] - ax, screen[3 * c + 1] - ay];
        const area = bx * cy - by * cx, [x, y] = [right - ax, up - ay];
        const [s, r] = [(x * cy - y * cx) / area, (bx * y - by * x) / area];
        if (!(s >= 0 && r >= 0 && s + r <= 1)) continue;
        const shares = [1 - s - r, s, r];
        const mean = of => shares.reduce((sum, share, k) => sum + share * of(nodes[k]), 0);
        const depth = mean(node => screen[3 * node + 2]);
        const beyond = [0, 1, 2].reduce((sum, k) => sum + cut[k] * mean(node => moved(node, k)), 0) > cut[3];
        if (beyond || best && best.depth <= depth) continue;
        best = { depth, part, nodes: [...nodes], shares, place: [0, 1, 2].map(k => mean(node => points[3 * node + k])) };
      }
    }
    return best;
  };
  // the value of a hit in words
  const told = ({ part, nodes, shares, place }) => {
    const at = place.slice(0, data.space ? 3 : 2).map((x, k) => number(x + data.origin[k])).join(", ");
    if (what.value === "places") return `${part.name} at (${at})`;
    const [low, high] = range(), { values } = fieldOf(part);
    const size = node => Math.hypot(...part.arrays.displacement.data.subarray(3 * node, 3 * node + 3));
    const value = node => what.value === "travel" ? size(node) : values[node] === 65535 ? NaN : low + values[node] / 65534 * (high - low);
    const mean = nodes.reduce((sum, node, k) => sum + shares[k] * value(node), 0);
    return `${part.name} at (${at}): ${Number.isNaN(mean) ? "open" : number(mean)} (${what.selectedOptions[0].text})`;
  };
  let pointing = null;
  const point = () => {
    if (!pointing || !eye.view) return;
    const box = canvas.getBoundingClientRect();
    const found = hit(2 * (pointing.clientX - box.left) / box.width - 1, 1 - 2 * (pointing.clientY - box.top) / box.height);
    under.textContent = found ? told(found) : "";
    pointing = null;
  };

  const fingers = new Map();
  canvas.addEventListener("pointerdown", e => { fingers.set(e.pointerId, e); canvas.setPointerCapture(e.pointerId); });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, e => fingers.delete(e.pointerId));
  canvas.addEventListener("pointermove", e => {
    const before = fingers.get(e.pointerId);
    if (!before) {
      if (!pointing) requestAnimationFrame(point);
      pointing = e;
      return;
    }
    const [dx, dy] = [e.clientX - before.clientX, e.clientY - before.clientY];
    if (fingers.size === 2) {
      const [other] = [...fingers.values()].filter(f => f.pointerId !== e.pointerId);
      const apart = f => Math.hypot(f.clientX - other.clientX, f.clientY - other.clientY) || 1;
      eye.zoom *= apart(e) / apart(before);
    } else if (!data.space || e.shiftKey || e.buttons & 2) {
      const pixel = size / eye.zoom / Math.min(canvas.clientWidth, canvas.clientHeight);
      eye.right -= dx * pixel;
      eye.up += dy * pixel;
    } else {
      eye.turn -= dx * 0.01;
      eye.rise = Math.max(-1.55, Math.min(1.55, eye.rise + dy * 0.01));
    }
    fingers.set(e.pointerId, e);
    redraw();
  });
  canvas.addEventListener("wheel", e => { e.preventDefault(); eye.zoom *= Math.exp(-e.deltaY * 0.001); redraw(); }, { passive: false });
  canvas.addEventListener("contextmenu", e => e.preventDefault());
  what.addEventListener("change", () => { typed.forEach(input => { input.value = ""; }); legend(); });
  across?.addEventListener("change", legend);
  typed.forEach(input => input.addEventListener("input", legend));
  for (const slider of [scale, depth]) slider?.addEventListener("input", redraw);
  again.addEventListener("click", () => { reset(); redraw(); });
  save.addEventListener("click", savePicture);
  for (const box of figure.querySelectorAll("input[type=checkbox]")) box.addEventListener("change", () => {
    parts.filter(part => part.body === +box.value).forEach(part => { part.shown = box.checked; });
    redraw();
  });
  new ResizeObserver(redraw).observe(canvas);
  reset();
  legend();
  draw();
})();
