// Keeps the state of the page in its address, turns "/" into a jump to the search, and looks often
// for a dashboard that is back.
export default {
  template: `<span hidden></span>`,
  mounted() {
    // The socket is made after the elements. The usual 1000 to 5000 ms keep a page waiting.
    setTimeout(() => {
      window.socket?.io?.reconnectionDelay?.(250);
      window.socket?.io?.reconnectionDelayMax?.(500);
    });
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
