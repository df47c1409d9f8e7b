// Colours as [red, green, blue], 0 to 255.

export const stone = [214, 199, 172];
export const fuzzy = [74, 144, 226];
const few = [
  [78, 121, 167], [242, 142, 43], [89, 161, 79], [225, 87, 89], [118, 183, 178], [237, 201, 72], [176, 122, 161],
  [156, 117, 95], [255, 157, 167], [134, 188, 182], [186, 176, 172], [95, 112, 196],
];

/** One for each number: some that differ well, then ever more. */
export function ofNumber(number) {
  if (number < 0) return [170, 176, 182];
  if (number < few.length) return few[number];
  const hue = (number * 137.508) % 360;
  const light = 0.5 + 0.12 * ((number * 7) % 3 - 1);
  const f = (n) => {
    const k = (n + hue / 30) % 12;
    return Math.round(255 * (light - 0.5 * Math.min(light, 1 - light) * Math.max(-1, Math.min(k - 3, 9 - k, 1))));
  };
  return [f(0), f(8), f(4)];
}

const linearOf = Array.from({ length: 256 }, (_, i) => {
  const x = i / 255;
  return Math.round(255 * (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4));
});
/** As the graphics card computes with them. */
export const linear = (colour) => colour.slice(0, 3).map((x) => linearOf[x]);
export const hex = (colour) => (colour[0] << 16) | (colour[1] << 8) | colour[2];
export const css = (colour) => `rgb(${colour.slice(0, 3).join(',')})`;
