// Words that are explained where they stand: pointed at, touched, or reached by the keyboard.

/** The words of WORDS (key, title, meaning, pattern) that are marked, each a group of one pattern. */
const MARKED = WORDS.filter(([, , , found]) => found);
const FOUND = new RegExp(MARKED.map(([, , , found]) => `((?<![\\w-])(?:${found})(?![\\w-]))`).join("|"), "g");
/** In each of these parts of a page a word is marked once, and none in what is passed over. */
const PARTS = "section, table, details, ul, dl", PASSED = "a, button, code, svg, canvas, select, label, h1, dt, noscript, script, style, .term, .meaning, .plain";

const marked = new WeakMap(); // part to its marked words, by key

/** Mark the words in a part of a page; a team may be called by one of them. */
function explain(root) {
  const names = new Set([...document.querySelectorAll("nav a")].map((each) => each.textContent));
  const walker = document.createTreeWalker(root, NodeFilter.SHOW_TEXT), nodes = [];
  while (walker.nextNode()) nodes.push(walker.currentNode);
  for (let node of nodes) {
    if (!node.parentElement || node.parentElement.closest(PASSED)) continue;
    const part = node.parentElement.closest("article") ?? node.parentElement.closest(PARTS) ?? document.body;
    if (!marked.has(part)) marked.set(part, new Map());
    let from = 0, hit;
    while (FOUND.lastIndex = from, hit = FOUND.exec(node.data)) {
      const [key] = MARKED[hit.slice(1).findIndex((each) => each !== undefined)];
      from = hit.index + hit[0].length;
      if (names.has(hit[0]) || marked.get(part).get(key)?.isConnected) continue;
      const word = node.splitText(hit.index), term = document.createElement("span");
      node = word.splitText(hit[0].length);
      from = 0;
      marked.get(part).set(key, term);
      word.replaceWith(term);
      term.append(word);
      term.className = "term";
      term.tabIndex = 0;
      term.dataset.term = key;
      term.setAttribute("aria-describedby", "meaning");
    }
  }
}

addEventListener("DOMContentLoaded", () => {
  const bubble = document.createElement("div");
  bubble.id = bubble.className = "meaning";
  bubble.setAttribute("role", "tooltip");
  bubble.hidden = true;
  document.body.append(bubble);
  let of = null; // the word whose meaning is shown

  function show(term) {
    of = term;
    bubble.hidden = !term;
    if (!term) return;
    const [, title, means] = WORDS.find(([key]) => key === term.dataset.term), head = document.createElement("b");
    head.textContent = title;
    bubble.replaceChildren(head, means.replaceAll("`", ""));
    const { left, top, bottom } = term.getBoundingClientRect(), { offsetWidth: wide, offsetHeight: high } = bubble;
    bubble.style.left = `${Math.max(8, Math.min(left, innerWidth - wide - 8))}px`;
    bubble.style.top = `${bottom + high + 12 < innerHeight ? bottom + 2 : Math.max(8, top - high - 2)}px`;
  }

  const termOf = ({ target }) => (target.closest ? target.closest("[data-term]") : null);
  document.addEventListener("pointerover", (event) => {
    if (bubble.contains(event.target)) return; // so that it can be read, and selected
    if (termOf(event)) show(termOf(event)); else if (of !== document.activeElement) show(null);
  });
  document.addEventListener("focusin", (event) => show(event.target.matches(":focus-visible") ? termOf(event) : null));
  document.addEventListener("click", (event) => { // a finger has no hover: its focus comes after the pointer, and hid what that showed
    if (event.target.closest?.(".term")) show(termOf(event));
  });
  document.addEventListener("focusout", () => show(null));
  document.addEventListener("keydown", ({ key }) => { if (key === "Escape") show(null); });
  addEventListener("scroll", () => show(of === document.activeElement ? of : null), { capture: true, passive: true });
  explain(document.querySelector("main") ?? document.body);
});
