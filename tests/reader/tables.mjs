// Static tables of symbols (FORMAT.md, section 6).

import { slotEntries } from "./ans.mjs";
import { Cursor, fround, need, within } from "./bytes.mjs";

/** One table, which begins where the cursor stands. */
export function readTable(from, name) {
  const place = `${from.place}: ${name}`;
  const origin = from.f32("origin");
  const step = from.f32("step");
  need(step > 0 && Number.isFinite(step), `${place}: step`, step, "finite and positive");
  const reach = fround(fround(step * 32768) + Math.abs(origin));
  need(reach < fround(1e18), `${place}: step·32768 + |origin|`, reach, "below 1e18");
  const minSymbol = from.i16("min_symbol");
  const nSymbols = from.u16("n_symbols");
  need(minSymbol + nSymbols - 1 <= 32767, `${place}: largest symbol`, minSymbol + nSymbols - 1, "at most 32767");
  const bounds = from.u16s(nSymbols + 2, "bounds");
  within(`${place}: first bound`, bounds[0], 0, 0);
  within(`${place}: last bound`, bounds[nSymbols + 1], 4096, 4096);
  for (let i = 1; i <= nSymbols; i++) within(`${place}: bound ${i}`, bounds[i], bounds[i - 1], 4095);
  return { origin, step, minSymbol, nSymbols, bounds, entries: slotEntries(bounds) };
}

export function decodeSymbol(table, ans) {
  const entry = ans.entry(table.bounds, table.entries);
  return entry === table.nSymbols ? ans.rawSymbol() : table.minSymbol + entry;
}

export const tableValue = (table, symbol) => fround(table.origin + fround(symbol * table.step));

/** The tables of a scene without a context: a coder of its channels. */
export function readTables(bytes, channels) {
  const from = new Cursor(bytes, "tables");
  const nTables = within("tables: n_tables", from.u16("n_tables"), 1, 360);
  within("tables: n_channels", from.u16("n_channels"), channels, channels);
  const ofChannel = from.u16s(channels, "table of channel", [(t) => t < nTables, `below ${nTables}`]);
  const begins = from.u32s(nTables, "where tables begin");
  const tables = Array.from(begins, (begin, i) => {
    need(begin === from.at, `tables: where table ${i} begins`, begin, `${from.at}`);
    return readTable(from, `table ${i}`);
  });
  from.end();
  return { tables, ofChannel };
}
