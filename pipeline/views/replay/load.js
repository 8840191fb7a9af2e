// Where the page has its match from.

document.getElementById("lone")?.remove();

/**
 * The match's payload and the known behaviours: from the page itself, or from the scripts of the scout's folder.
 * Pages that are opened from disk may load scripts, but fetch nothing.
 */
async function data(holder) {
  const { match: id, up } = holder.dataset;
  if (id === undefined) return [holder.textContent, []];
  const called = (name, file) => new Promise((resolve, reject) => {
    window[name] = (...given) => resolve(given.at(-1));
    const script = document.createElement("script");
    script.src = `${up}${file}`;
    script.onerror = () => reject(new Error(`${file} is missing beside this page's folder; write the scout's pages again`));
    document.head.append(script);
  });
  return Promise.all([called("scoutMatch", `data/${encodeURIComponent(id)}.js`), called("scoutKnown", "known.js")]);
}
