// What comes from bsp2: messages of a header in JSON and arrays of numbers, see api/src/viewer/message.hpp.

const types = { u8: Uint8Array, u16: Uint16Array, u32: Uint32Array, i32: Int32Array, f32: Float32Array };

/** @returns {object} the header; its `arrays` are typed arrays that look into the bytes. */
export function decode(bytes) {
  const length = new DataView(bytes).getUint32(0, true);
  const message = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 4, length)));
  const arrays = {};
  for (const [name, [type, first, count, stride]] of Object.entries(message.arrays ?? {})) {
    const array = new types[type](bytes, 4 + length + first, count);
    if (stride > 0) for (let i = stride; i < count; ++i) array[i] += array[i - stride]; // modulo the range of the type
    arrays[name] = array;
  }
  return Object.assign(message, { arrays, size: bytes.byteLength });
}

/** Keeps in touch with bsp2. Calls on.message(message), on.seen(number of a gaze), and on.state('open' | 'lost' | 'gone'). */
export function connect(on) {
  const address = new URL('data', location.href);
  address.protocol = 'ws:';
  address.hash = '';
  address.search = '?levels'; // the page tells where it looks
  let socket = null;
  let failures = 0;
  const open = () => {
    socket = new WebSocket(address);
    socket.binaryType = 'arraybuffer';
    socket.onopen = () => { failures = 0; on.state('open'); };
    socket.onmessage = ({ data }) => { if (typeof data === 'string') on.seen(JSON.parse(data).seen); else on.message(decode(data)); };
    socket.onclose = () => {
      failures += 1;
      on.state(failures > 3 ? 'gone' : 'lost');
      setTimeout(open, Math.min(5000, 250 * 2 ** failures));
    };
  };
  open();
  return { say: (what) => { if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(what)); } };
}
