// Draws three arrays of corners (position, normal, colour): triangles, lines, points.
const canvas = document.querySelector("canvas");
const gl = canvas.getContext("webgl");
const shader = (kind, text) => {
  const result = gl.createShader(kind);
  gl.shaderSource(result, text);
  gl.compileShader(result);
  return result;
};
const program = gl.createProgram();
gl.attachShader(program, shader(gl.VERTEX_SHADER, `
  attribute vec3 position, normal, colour;
  uniform mat3 turn;
  uniform vec2 scale;
  varying vec3 shade;
  void main() {
    vec3 p = turn * position;
    gl_Position = vec4(p.xy * scale, -p.z * 0.5, 1.0);
    gl_PointSize = 4.0;
    float light = dot(normal, normal) > 0.0 ? 0.35 + 0.65 * abs(dot(turn * normal, vec3(0.2, 0.5, 0.84))) : 0.6;
    shade = colour * light;
  }`));
gl.attachShader(program, shader(gl.FRAGMENT_SHADER, `
  precision mediump float;
  varying vec3 shade;
  void main() { gl_FragColor = vec4(shade, 1.0); }`));
gl.linkProgram(program);
gl.useProgram(program);
const parts = ARRAYS.map((text, i) => {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const buffer = gl.createBuffer();
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  gl.bufferData(gl.ARRAY_BUFFER, bytes, gl.STATIC_DRAW);
  return { buffer, count: bytes.length / 36, mode: [gl.TRIANGLES, gl.LINES, gl.POINTS][i] };
});
let azimuth = -0.52, height = 0.38, zoom = 1.8;
function draw() {
  canvas.width = canvas.clientWidth;
  canvas.height = canvas.clientHeight;
  gl.viewport(0, 0, canvas.width, canvas.height);
  gl.clearColor(1, 1, 1, 1);
  gl.enable(gl.DEPTH_TEST);
  gl.enable(gl.POLYGON_OFFSET_FILL);
  gl.polygonOffset(1, 1);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  const ca = Math.cos(azimuth), sa = Math.sin(azimuth), ch = Math.cos(height), sh = Math.sin(height);
  const rows = [[ca, -sa, 0], [-sa * sh, -ca * sh * -1, ch], [-sa * ch, -ca * ch, sh]];
  const turn = [0, 1, 2].flatMap((c) => rows.map((row) => row[c]));
  gl.uniformMatrix3fv(gl.getUniformLocation(program, "turn"), false, turn);
  const aspect = canvas.width / canvas.height;
  gl.uniform2f(gl.getUniformLocation(program, "scale"), zoom / Math.max(1, aspect), zoom * Math.min(1, aspect));
  for (const part of parts) {
    gl.bindBuffer(gl.ARRAY_BUFFER, part.buffer);
    ["position", "normal", "colour"].forEach((name, i) => {
      const place = gl.getAttribLocation(program, name);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 36, 12 * i);
    });
    gl.drawArrays(part.mode, 0, part.count);
  }
}
canvas.onpointermove = (event) => {
  if (!event.buttons) return;
  azimuth += event.movementX * 0.008;
  height += event.movementY * 0.008;
  draw();
};
canvas.onwheel = (event) => {
  event.preventDefault();
  zoom *= Math.exp(-event.deltaY * 0.001);
  draw();
};
window.onresize = draw;
draw();
