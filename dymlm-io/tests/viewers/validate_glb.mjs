// Khronos' validator on .glb files: npm install gltf-validator && node validate_glb.mjs FILE.glb ...
// Run it in the folder that has node_modules. Errors and warnings fail.
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';

const validator = createRequire(`${process.cwd()}/`)('gltf-validator');
let failed = process.argv.length < 3;
for (const file of process.argv.slice(2)) {
  const { issues, info } = await validator.validateBytes(new Uint8Array(readFileSync(file)), { maxIssues: 100 });
  const { numErrors, numWarnings, numInfos, numHints } = issues;
  console.log(`${file}: ${numErrors} errors, ${numWarnings} warnings, ${numInfos} infos, ${numHints} hints;`,
    `${info.drawCallCount} draw calls, ${info.totalVertexCount} vertices, ${info.totalTriangleCount} triangles`);
  for (const { code, message, pointer } of issues.messages) console.log(`  ${code} ${pointer}: ${message}`);
  failed ||= numErrors + numWarnings > 0;
}
process.exit(failed ? 1 : 0);
