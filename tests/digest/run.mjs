// Runs a program of wasm32-wasip1: node run.mjs PROGRAM
import { readFile } from 'node:fs/promises';
import { argv, exit } from 'node:process';
import { WASI } from 'node:wasi';

const wasi = new WASI({ version: 'preview1', returnOnExit: true });
// Not `getImportObject`, which Node.js 18 may lack.
const imports = { wasi_snapshot_preview1: wasi.wasiImport };
const { instance } = await WebAssembly.instantiate(await readFile(argv[2]), imports);
exit(wasi.start(instance));
