// Parts that all panels are made of. Everything is set as text, never as markup.

function element(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) node.addEventListener(key.slice(2), value);
    else if (key === "colour") node.style.setProperty("--colour", `var(--${value})`);
    else if (value !== null && value !== false) node.setAttribute(key, value === true ? "" : value);
  }
  node.append(...children.filter((child) => child !== null && child !== undefined && child !== false));
  return node;
}

// Put parts into the element of this id, and hide it if there are none.
function fill(id, ...children) {
  const there = children.filter(Boolean), node = document.getElementById(id);
  node.hidden = !there.length;
  node.replaceChildren(...there);
}

const button = (text, onclick, attributes = {}) => element("button", { type: "button", onclick, ...attributes }, text);
const heading = (text) => element("h2", {}, text);

function facts(rows) {
  const list = element("dl", { class: "facts" });
  for (const [name, value, kind] of rows) {
    if (value !== null) list.append(element("dt", {}, name), element("dd", kind ? { class: kind } : {}, value));
  }
  return list;
}

function list(sentences) {
  return sentences.length ? element("ul", { class: "notes" }, ...sentences.map((text) => element("li", {}, text))) : null;
}

function swatch({ colour, key, hollow }) {
  return element("span", { class: hollow ?? key === "offline" ? "swatch hollow" : "swatch", colour: colour ?? key });
}

// Long lists open with the first hundred.
function capped(rows, most = 100) {
  if (rows.length <= most) return rows;
  const rest = element("div", { class: "rest" });
  const all = () => rest.replaceWith(...rows.slice(most));
  rest.append(button(`Show ${rows.length - most} more`, all, { class: "more" }));
  return [...rows.slice(0, most), rest];
}

function chips(words, arms, model, actions) {
  if (!arms.length) return null;
  const buttons = arms.map((arm) => button(model.armName(arm), () => actions.goTo(arm)));
  return element("div", { class: "chips" }, words, ...buttons);
}
