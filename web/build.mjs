// Makes the page: node build.mjs FOLDER. One script and one style sheet, which name no host but the page's own.
import { build } from 'esbuild';
import { copyFile, mkdir, readFile, writeFile } from 'node:fs/promises';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

const folder = process.argv[2];
const source = join(dirname(fileURLToPath(import.meta.url)), 'src');
await mkdir(folder, { recursive: true });
await build({
  entryPoints: [join(source, 'view.js')],
  outfile: join(folder, 'view.js'),
  bundle: true,
  minify: true,
  format: 'iife',
  target: 'es2020',
  legalComments: 'none',
  logLevel: 'warning',
});
// What libraries say of their own pages goes; names of XML namespaces are no addresses, and stay.
const namespaces = /^http:\/\/www\.w3\.org\//;
const script = await readFile(join(folder, 'view.js'), 'utf8');
const licence = '/* Holds three.js, (c) its authors, under the MIT licence. */\n';
await writeFile(join(folder, 'view.js'),
  licence + script.replace(/https?:\/\/[\w.-]+\.[a-z]+[^\s"'`)\\<>]*/g, (address) => namespaces.test(address) ? address : ''));
await copyFile(join(source, 'view.css'), join(folder, 'view.css'));
await copyFile(join(source, 'index.html'), join(folder, 'index.html'));
