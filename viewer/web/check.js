// Numbers are checked by name before they reach WebAssembly, which would cut them to its own sizes without a word.

function said(value) {
  if (typeof value === 'string') return JSON.stringify(value);
  if (value === undefined) return 'missing';
  return typeof value === 'object' && value ? 'an object' : `${String(value)}${typeof value === 'bigint' ? 'n' : ''}`;
}

/** Throws: what was given, and what is needed. */
export function refuse(name, value, needed) {
  throw new RangeError(`${name} is ${said(value)}; needs ${needed}`);
}

/** A whole number within limits. */
export function whole(name, value, least, most) {
  if (!Number.isInteger(value) || value < least || value > most) refuse(name, value, `a whole number from ${least} to ${most}`);
  return value;
}

/** A number that is finite as 32 bits. */
export function real(name, value) {
  if (typeof value !== 'number' || !Number.isFinite(Math.fround(value))) refuse(name, value, 'a finite number, at most 3.4e38 in size');
  return value;
}

/** A number above 0, as 32 bits. */
export function positive(name, value) {
  const narrow = typeof value === 'number' ? Math.fround(value) : NaN;
  if (!(narrow > 0 && narrow < Infinity)) refuse(name, value, 'a number above 0, at most 3.4e38');
  return value;
}

/** So many numbers, each checked by `check`. */
export function list(name, values, n, check) {
  if (!(Array.isArray(values) || ArrayBuffer.isView(values)) || values.length !== n) {
    const length = values?.length;
    throw new RangeError(`${name} is ${length === undefined ? said(values) : `${length} numbers`}; needs an array of ${n} numbers`);
  }
  // Not `forEach`, which passes over holes.
  for (let i = 0; i < n; i++) check(`${name}[${i}]`, values[i]);
  return values;
}
