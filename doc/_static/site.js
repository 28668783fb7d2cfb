// What the theme leaves out for those who read by ear or by keys.
const mend = () => {
  document.querySelectorAll("p.caption[role=heading]").forEach(one => one.setAttribute("aria-level", "2"));
  document.querySelectorAll(".wy-nav-content footer").forEach(one => one.setAttribute("role", "contentinfo"));
  document.querySelectorAll("footer div[role=contentinfo]").forEach(one => one.removeAttribute("role"));
  document.querySelectorAll("div.highlight pre, .wy-table-responsive").forEach(one => {
    if (one.scrollWidth > one.clientWidth) one.setAttribute("tabindex", "0"); else one.removeAttribute("tabindex");
  });
};
addEventListener("load", () => setTimeout(mend, 100)); // after the theme, which wraps the tables
addEventListener("resize", mend);
