/* Points of a trade-off: the settings of the selected one are shown and can be copied. */
class Points {
  constructor(place) {
    this.place = place;
    this.facts = JSON.parse(place.querySelector("script.facts").textContent);
    this.marks = [...place.querySelectorAll("[data-point]")];
    for (const mark of this.marks) {
      mark.addEventListener("click", () => this.choose(mark));
      mark.addEventListener("keydown", (event) => this.press(event, mark));
    }
    this.copy = place.querySelector(".copy");
    this.copy.addEventListener("click", () => this.copySettings());
    const first = this.marks.find((mark) => mark.querySelector(".best")) || this.front()[0];
    if (first) this.choose(first);
  }

  /* The points of the front by increasing cost. */
  front() {
    const cost = (mark) => Number(mark.querySelector(".hit-area").getAttribute("cx"));
    return this.marks.filter((mark) => "front" in mark.dataset).sort((a, b) => cost(a) - cost(b));
  }

  press(event, mark) {
    if (event.key === "Enter" || event.key === " ") this.choose(mark);
    else if (event.key === "ArrowRight" || event.key === "ArrowLeft") {
      const front = this.front();
      const next = front[front.indexOf(mark) + (event.key === "ArrowRight" ? 1 : -1)];
      if (next) {
        next.focus();
        this.choose(next);
      }
    } else return;
    event.preventDefault();
  }

  choose(mark) {
    for (const other of this.marks) other.toggleAttribute("data-chosen", other === mark);
    const { title, figures, text } = this.facts[Number(mark.dataset.point)];
    const aside = this.place.querySelector(".chosen");
    aside.querySelector(".what").textContent = title;
    aside.querySelector(".figures").replaceChildren(
      ...figures.flatMap(([name, value]) => {
        const [term, description] = [document.createElement("dt"), document.createElement("dd")];
        term.textContent = name;
        description.textContent = value;
        return [term, description];
      }),
    );
    aside.querySelector("code").textContent = text;
    aside.querySelector("pre").hidden = this.copy.hidden = false;
    this.copy.textContent = "Copy";
    this.place.dataset.chosen = mark.dataset.point;
  }

  /* Copy the settings; where that is not permitted, select them. */
  async copySettings() {
    const code = this.place.querySelector(".chosen code");
    try {
      await navigator.clipboard.writeText(`${code.textContent}\n`);
      this.copy.textContent = "Copied";
    } catch {
      const range = document.createRange();
      range.selectNodeContents(code);
      getSelection().removeAllRanges();
      getSelection().addRange(range);
      this.copy.textContent = "Selected: press Ctrl+C";
    }
  }
}

for (const place of document.querySelectorAll(".tradeoff")) new Points(place);
