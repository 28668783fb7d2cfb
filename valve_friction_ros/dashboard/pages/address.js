// Keeps the state of the page in its address, and turns "/" into a jump to the search.
export default {
  template: `<span hidden></span>`,
  mounted() {
    this.jump = (event) => {
      const typing = /^(INPUT|TEXTAREA|SELECT)$/.test(document.activeElement?.tagName);
      const search = document.querySelector("input[type=search], .vf-search input");
      if (event.key === "/" && !typing && search) { search.focus(); event.preventDefault(); }
    };
    document.addEventListener("keydown", this.jump);
  },
  unmounted() { document.removeEventListener("keydown", this.jump); },
  methods: { replace(address) { history.replaceState({}, "", address); } },
};
