// Evaluates an OpenSCAD .csg file with the npm package manifold-3d (a mesh kernel: its result is the boundary).
//
//     node manifold.mjs PACKAGE_FOLDER MODEL.csg [--memo]
//
// With --memo equal subtrees are evaluated once. Prints one line of JSON: volume, area, triangles, and the seconds of CPU
// from the parsed model to the finished mesh. Exit code 3: the model needs a node that is not handled here.
import {readFileSync} from 'node:fs';
import {join} from 'node:path';
import {pathToFileURL} from 'node:url';

const [packageFolder, path, ...flags] = process.argv.slice(2);
const memo = flags.includes('--memo');

class Unsupported extends Error {}

// --- reading: {name, args: {key: value}, children, text}; equal subtrees share one object -----------------------------

function parse(source) {
  let at = 0;
  const known = new Map();  // by text without white space: what makes two subtrees equal
  const space = /(?:\s+|\/\/[^\n]*|\/\*[^]*?\*\/)*/y;
  const word = /[A-Za-z_$][A-Za-z0-9_$]*/y;
  const numeral = /-?(?:inf|nan|\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+(?:[eE][-+]?\d+)?)/y;
  const match = (pattern) => {
    pattern.lastIndex = at;
    const found = pattern.exec(source);
    if (found === null) return null;
    at = pattern.lastIndex;
    return found[0];
  };
  const skip = () => match(space);
  const fail = () => { throw new Error(`${path}: cannot read this: ${source.slice(at, at + 40)}`); };
  const take = (text) => { skip(); if (!source.startsWith(text, at)) return false; at += text.length; return true; };
  const value = () => {
    skip();
    if (take('[')) {
      const list = [];
      while (!take(']')) { list.push(value()); take(','); }
      return list;
    }
    if (source[at] === '"') {
      const end = source.indexOf('"', at + 1);
      const text = source.slice(at + 1, end);
      at = end + 1;
      return text;
    }
    const digits = match(numeral);
    if (digits !== null) return Number(digits);
    const name = match(word);
    return name === 'true' ? true : name === 'false' ? false : name === 'undef' ? undefined : fail();
  };
  const node = () => {
    skip();
    const ghost = take('%');
    take('#'); take('!');
    skip();
    const name = match(word) ?? fail();
    if (!take('(')) fail();
    const args = {};
    let place = 0;
    while (!take(')')) {
      skip();
      const start = at, key = match(word);
      if (key !== null && take('=')) args[key] = value();
      else { at = start; args[place++] = value(); }
      take(',');
    }
    const children = [];
    if (take('{')) while (!take('}')) { const child = node(); if (child !== null) children.push(child); }
    else take(';');
    if (ghost) return null;
    const text = `${name}(${JSON.stringify(args)}){${children.map((c) => c.id).join()}}`;
    if (memo) {
      const same = known.get(text);
      if (same !== undefined) return same;
    }
    const made = {name, args, children, id: known.size};
    known.set(memo ? text : made, made);
    return made;
  };
  const nodes = [];
  for (skip(); at < source.length; skip()) { const made = node(); if (made !== null) nodes.push(made); }
  return nodes;
}

// --- evaluating --------------------------------------------------------------------------------------------------------

function fragments(r, {$fn = 0, $fa = 12, $fs = 2}) {
  if (r < 2 ** -20) return 3;
  if ($fn > 0) return Math.max(3, Math.trunc($fn));
  return Math.ceil(Math.max(Math.min(360 / $fa, 2 * Math.PI * r / $fs), 5));
}

const evaluators = (Manifold, Mesh) => {
  const done = new Map();
  const empty = () => Manifold.union([]);

  /** OpenSCAD's sphere: rings of points, none at the poles; turned about the axis it is a revolved half polygon. */
  const sphere = ({r = 1, ...rest}) => {
    const n = fragments(r, rest), rings = Math.trunc((n + 1) / 2), profile = [];
    for (let i = rings - 1; i >= 0; --i) {
      const angle = Math.PI * (i + 0.5) / rings;
      profile.push([r * Math.sin(angle), r * Math.cos(angle)]);
    }
    profile.push([0, profile[rings - 1][1]]);
    profile.unshift([0, profile[0][1]]);
    return Manifold.revolve([profile], n);
  };

  const cylinder = ({h = 1, r1 = 1, r2 = 1, center = false, ...rest}) => {
    if (!(h > 0 && r1 >= 0 && r2 >= 0 && r1 + r2 > 0)) return empty();
    const n = fragments(Math.max(r1, r2), rest);
    if (r1 > 0) return Manifold.cylinder(h, r1, r2, n, center);
    const upside = Manifold.cylinder(h, r2, 0, n, center).mirror([0, 0, 1]);
    return center ? upside : upside.translate([0, 0, h]);
  };

  /** Faces are fans: convex ones, which is what generators write. Points in one place are one vertex. */
  const polyhedron = ({points = [], faces = []}) => {
    const numbers = new Map(), numberOf = points.map((p) => {
      const key = p.join();
      if (!numbers.has(key)) numbers.set(key, numbers.size);
      return numbers.get(key);
    });
    const vertices = new Float32Array(3 * numbers.size);
    points.forEach((p, i) => vertices.set(p, 3 * numberOf[i]));
    const triangles = [];
    for (const face of faces)
      for (let i = 2; i < face.length; ++i) {
        const [a, b, c] = [face[0], face[i - 1], face[i]].map((v) => numberOf[v]);
        if (a !== b && b !== c && c !== a) triangles.push(c, b, a);  // .csg: clockwise seen from outside
      }
    return Manifold.ofMesh(new Mesh({numProp: 3, vertProperties: vertices, triVerts: Uint32Array.from(triangles)}));
  };

  const cube = ({size = [1, 1, 1], center = false}) => {
    const sizes = Array.isArray(size) ? size : [size, size, size];
    return sizes.every((s) => s > 0) ? Manifold.cube(sizes, center) : empty();
  };

  const transform = (matrix, solid) => {
    const w = matrix[3][3] === 0 ? 1 : matrix[3][3], columns = [];
    for (let j = 0; j < 4; ++j) columns.push(matrix[0][j] / w, matrix[1][j] / w, matrix[2][j] / w, j === 3 ? 1 : 0);
    return solid.transform(columns);
  };

  const make = {
    cube, sphere, cylinder, polyhedron,
    multmatrix: (args, solids) => transform(args[0] ?? args.m, Manifold.union(solids)),
    difference: (args, solids) => solids.length === 0 ? empty() : Manifold.difference(solids),
    intersection: (args, solids) => solids.length === 0 ? empty() : Manifold.intersection(solids),
    hull: (args, solids) => Manifold.hull(solids),
  };
  for (const name of ['union', 'group', 'render', 'color']) make[name] = (args, solids) => Manifold.union(solids);

  const evaluate = (node) => {
    if (done.has(node)) return done.get(node);
    if (!(node.name in make)) throw new Unsupported(node.name);
    const solid = make[node.name](node.args, node.children.map(evaluate));
    if (memo) {
      solid.numTri();  // operations are lazy: what is shared is evaluated now, once
      done.set(node, solid);
    }
    return solid;
  };
  return (nodes) => Manifold.union(nodes.map(evaluate));
};

const {default: load} = await import(pathToFileURL(join(packageFolder, 'manifold.js')));
const kernel = await load();
kernel.setup();
const nodes = parse(readFileSync(path, 'utf8'));
const before = process.cpuUsage();
try {
  const solid = evaluators(kernel.Manifold, kernel.Mesh)(nodes);
  const triangles = solid.numTri();
  const {user, system} = process.cpuUsage(before);
  console.log(JSON.stringify({volume: solid.volume(), area: solid.surfaceArea(), triangles, seconds: (user + system) / 1e6}));
} catch (error) {
  if (!(error instanceof Unsupported)) throw error;
  console.log(JSON.stringify({unsupported: error.message}));
  process.exit(3);
}
