// Bundles the report's page and writes it as C++, which the program carries.
//   node bundle.mjs PACKAGES OUT.cpp      PACKAGES: the node_modules that `npm ci` filled
import {existsSync, readdirSync, readFileSync, writeFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {dirname, join, resolve} from 'node:path';
import {fileURLToPath} from 'node:url';

const [packages, outFile] = process.argv.slice(2).map(path => resolve(path));
const here = dirname(fileURLToPath(import.meta.url));
const {build} = createRequire(join(packages, 'x.js'))('esbuild');

/** The licences of the packages whose files are in a bundle, from the packages' own files. */
function licencesOf(inputs) {
  const names = new Set();
  for (const input of inputs) {
    const inside = input.split('node_modules/')[1];
    if (!inside) continue;
    const parts = inside.split('/');
    names.add(parts[0].startsWith('@') ? `${parts[0]}/${parts[1]}` : parts[0]);
  }
  return [...names].sort().map(name => {
    const folder = join(packages, name);
    const about = JSON.parse(readFileSync(join(folder, 'package.json'), 'utf8'));
    const file =
        readdirSync(folder).find(entry => /^(licen[cs]e|copying)(\.(md|txt))?$/i.test(entry));
    if (!file) throw new Error(`${name}: the package has no licence file`);
    return {
      name,
      version: about.version,
      licence: about.license,
      text: readFileSync(join(folder, file), 'utf8').trim()
    };
  });
}

const options = {
  absWorkingDir: here,
  entryPoints: ['src/main.ts'],
  nodePaths: [packages],
  bundle: true,
  minify: true,
  format: 'iife',
  target: ['es2022'],
  charset: 'ascii',
  legalComments: 'none',  // the page's foot shows each licence whole
  metafile: true,
  write: false,
  logLevel: 'warning',
};
// What is bundled tells whose licences are shown; the second run has them.
const first = await build({...options, define: {LICENCES: '[]'}});
const licences = licencesOf(Object.keys(first.metafile.inputs));
const script = await build({...options, define: {LICENCES: JSON.stringify(licences)}});
const style = await build({
  absWorkingDir: here,
  entryPoints: ['src/page.css'],
  bundle: true,
  minify: true,
  charset: 'utf8',
  write: false,
  logLevel: 'warning',
});

/** Text as a C++ array of string literals, each short enough for every compiler. */
function literals(text) {
  const bytes = Buffer.from(text, 'utf8');
  const lines = [];
  const piece = 4000;
  for (let begin = 0; begin < bytes.length; begin += piece) {
    let line = '';
    for (const byte of bytes.subarray(begin, begin + piece)) {
      const char = String.fromCharCode(byte);
      if (char === '\\' || char === '"')
        line += `\\${char}`;
      else if (char === '?')
        line += '\\?';  // no trigraphs
      else if (byte >= 32 && byte < 127)
        line += char;
      else
        line += `\\${byte.toString(8).padStart(3, '0')}`;
    }
    lines.push(`    "${line}",`);
  }
  return lines.join('\n');
}

const cpp = `// Made by validate/page/bundle.mjs; not to be edited.
#include "validate/page_bundle.h"

#include <string>

namespace terracast::validate {
namespace {

constexpr std::string_view kScript[] = {
${literals(script.outputFiles[0].text)}
};
constexpr std::string_view kStyle[] = {
${literals(style.outputFiles[0].text)}
};

template <std::size_t count>
std::string joined(const std::string_view (&pieces)[count]) {
  std::string text;
  for (const std::string_view piece : pieces) text += piece;
  return text;
}

}  // namespace

std::string_view page_script() {
  static const std::string text = joined(kScript);
  return text;
}
std::string_view page_style() {
  static const std::string text = joined(kStyle);
  return text;
}

}  // namespace terracast::validate
`;
if (!existsSync(outFile) || readFileSync(outFile, 'utf8') !== cpp) writeFileSync(outFile, cpp);
console.log(
    `page: ${(script.outputFiles[0].contents.length / 1024).toFixed(0)} KiB of script with ` +
    licences.map(l => `${l.name} ${l.version} (${l.licence})`).join(', '));
