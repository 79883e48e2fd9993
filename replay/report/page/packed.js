// Done when all packed data is in the document: a part of it stands behind the scripts, so that the first screen does not wait for it.
const complete = new Promise((resolve) => { if (document.readyState === 'loading') document.addEventListener('DOMContentLoaded', resolve); else resolve(); });

// Documents of numbers, as replay/report/page_parts.h packs them; a group is unpacked on the first request for one of its documents.

async function unzip(text) {
  const letters = atob(text.trim()), bytes = new Uint8Array(letters.length);
  for (let k = 0; k < letters.length; ++k) bytes[k] = letters.charCodeAt(k);
  return new Uint8Array(await new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip'))).arrayBuffer());
}

function readDocuments(bytes) {
  const length = new DataView(bytes.buffer).getUint32(0, true), heads = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + length)));
  const before = new Map();
  let at = 4 + length;
  const varint = () => {
    let value = 0, place = 1, byte = 0;
    do { byte = bytes[at++]; value += (byte & 127) * place; place *= 128; } while (byte >= 128);
    return value % 2 === 0 ? value / 2 : -(value + 1) / 2;
  };
  const column = ([count, way], path) => {
    const last = before.get(path), values = new Array(count);
    for (let k = 0; k < count; ++k) values[k] = varint() + (way === 1 ? last[k] : k > 0 ? values[k - 1] : 0);
    before.set(path, values);
    return values;
  };
  const restore = (value, path) => {
    if (value === null || typeof value !== 'object') return value;
    if (Array.isArray(value)) return value.map((item, index) => restore(item, `${path}/${index}`));
    if (value.column) return column(value.column, path);
    if (value.lists && value.of) {
      const lengths = column(value.lists.column, path + '/lists'), numbers = column(value.of.column, path + '/of');
      let from = 0;
      return lengths.map((size) => numbers.slice(from, (from += size)));
    }
    return Object.fromEntries(Object.entries(value).map(([key, item]) => [key, restore(item, `${path}/${key}`)]));
  };
  return heads.map((head) => restore(head, ''));
}

const groups = new Map();  // the last used ones
function documentOf([group, index]) {
  if (!groups.has(group)) {
    if (groups.size > 4) groups.delete(groups.keys().next().value);
    groups.set(group, complete.then(() => unzip(document.getElementById(group).textContent)).then(readDocuments));
  }
  return groups.get(group).then((documents) => documents[index]);
}
