"use strict";
for (const viewer of document.querySelectorAll(".viewer")) {
  const pictures = [...viewer.querySelectorAll("img")], buttons = [...viewer.querySelectorAll("button")];
  const show = (chosen) => pictures.forEach((picture, index) => {
    picture.hidden = index !== chosen;
    buttons[index].setAttribute("aria-pressed", index === chosen);
  });
  buttons.forEach((button, index) => button.addEventListener("click", () => show(index)));
}
for (const button of document.querySelectorAll("button.copy")) {
  button.addEventListener("click", async () => {
    await navigator.clipboard.writeText(button.previousElementSibling.textContent);
    button.textContent = "copied";
  });
}
for (const button of document.querySelectorAll("button.columns")) {
  button.addEventListener("click", () => {
    const brief = button.nextElementSibling.querySelector("table").classList.toggle("brief");
    button.textContent = brief ? "all columns" : "fewer columns";
  });
}
for (const table of document.querySelectorAll("table.sortable")) {
  [...table.tHead.rows[0].cells].forEach((head, column) => head.addEventListener("click", () => {
    const body = table.tBodies[0], sign = head.dataset.order === "up" ? -1 : 1;
    head.dataset.order = sign > 0 ? "up" : "down";
    const text = (row) => row.cells[column].textContent, value = (row) => parseFloat(text(row).replace("∞", "1e99"));
    const compare = (one, two) => {
      const first = value(one), second = value(two);
      if (isNaN(first) || isNaN(second)) {
        if (isNaN(first) && isNaN(second)) return sign * text(one).localeCompare(text(two));
        return isNaN(first) ? 1 : -1;
      }
      return sign * (first - second);
    };
    body.append(...[...body.rows].sort(compare));
  }));
}
