// The valves of a plant as a table or as tiles. The server sends rows that have changed, the order,
// and its clock; ages are counted here, so they grow on where the connection is lost.
// All text goes into text nodes and attributes by Vue's bindings, never into markup. Only rows near
// the view are drawn: more come as it is scrolled.
const STEP = 60;
const UNITS = [[86400 * 365.25, "y"], [86400, "d"], [3600, "h"], [60, "min"]];

function age(seconds) {
  for (const [size, unit] of UNITS) {
    if (seconds >= size) return `${Math.floor(seconds / size)} ${unit}`;
  }
  return `${Math.max(0, Math.floor(seconds))} s`;
}

const CELLS = `
  <span class="vf-chip" :class="'vf-' + row.state">
    <b class="vf-ne" v-if="row.ne" :title="'NE 107: ' + row.ne">{{ row.ne }}</b>{{ row.word }}
  </span>`;

export default {
  template: `
  <div class="vf-plant" @keydown="move">
    <p class="vf-lost" v-if="lost > 4" role="alert">
      No connection to the dashboard for {{ age(lost) }}: the values shown are that old.
    </p>
    <table v-if="!tiled" class="vf-table">
      <thead><tr>
        <th v-for="one in columns" :key="one.key" :class="one.css" scope="col"
            :aria-sort="sort === one.sort ? (reversed ? 'ascending' : 'descending') : null">
          <button v-if="one.sort" type="button" @click="$emit('sort', one.sort)"
                  :aria-label="'Sort by ' + one.title">
            {{ one.title }}<small v-if="one.unit"> {{ one.unit }}</small>
            <span class="vf-arrow" aria-hidden="true">{{
              sort === one.sort ? (reversed ? "▲" : "▼") : "" }}</span>
          </button>
          <span v-else>{{ one.title }}<small v-if="one.unit"> {{ one.unit }}</small></span>
        </th>
      </tr></thead>
      <tbody>
        <tr v-for="row in near" :key="row.i" :class="'vf-row vf-is-' + row.state"
            v-memo="[row, since(row), heard(row)]" @click="open($event, row)">
          <td class="vf-c-state">${CELLS}</td>
          <td class="vf-c-tag"><a :href="row.href">{{ row.tag }}</a><small>{{ row.place }}</small></td>
          <td class="vf-c-say"><b v-if="row.advice">{{ row.advice }}</b><span :title="row.say">{{ row.say }}</span></td>
          <td class="vf-c-ratio vf-n" data-label="friction ratio">
            <span class="vf-bar" aria-hidden="true"><i v-if="row.bar"
              :style="{left: row.bar[1] + '%', right: 100 - row.bar[2] + '%'}"></i><u v-if="row.bar"
              :style="{left: row.bar[0] + '%'}"></u><s></s></span>
            <b>{{ row.ratio }}</b><small>{{ row.between }}</small></td>
          <td class="vf-c-dead vf-n" data-label="dead band, %"><b>{{ row.dead }}</b><small>{{ row.deadw }}</small></td>
          <td class="vf-c-fc vf-n" data-label="friction, N"><b>{{ row.fc }}</b><small>{{ row.fcw }}</small><small class="vf-of">{{ row.fcof }}</small></td>
          <td class="vf-c-trend"><svg v-if="row.spark" viewBox="0 0 100 24" preserveAspectRatio="none"
              role="img" :aria-label="'friction ratio of the last ' + row.days + ' days'">
              <path class="vf-one" :d="row.base"/><path :d="row.spark"/></svg><small>{{ row.expected }}</small></td>
          <td class="vf-c-drift vf-n" data-label="drift, N per month"><b>{{ row.drift }}</b></td>
          <td class="vf-c-age vf-n" data-label="identified">{{ since(row) }}</td>
          <td v-if="live" class="vf-c-heard vf-n" data-label="heard">{{ heard(row) }}</td>
        </tr>
      </tbody>
    </table>
    <ul v-else class="vf-tiles">
      <li v-for="row in near" :key="row.i" v-memo="[row, since(row), heard(row)]">
        <a :href="row.href" class="vf-tile" :class="'vf-is-' + row.state">
          <span class="vf-tile-head"><strong>{{ row.tag }}</strong>${CELLS}</span>
          <span class="vf-tile-say"><b v-if="row.advice">{{ row.advice }}</b> {{ row.say }}</span>
          <span class="vf-tile-foot vf-n"><b>{{ row.ratio === "–" ? "" : "× " + row.ratio }}</b>
            <small>{{ row.between }}</small>
            <svg v-if="row.spark" viewBox="0 0 100 24" preserveAspectRatio="none" aria-hidden="true">
              <path class="vf-one" :d="row.base"/><path :d="row.spark"/></svg>
            <small>{{ ["silent", "unheard"].includes(row.state) ? heard(row) : since(row) }}</small></span>
        </a>
      </li>
    </ul>
    <p class="vf-empty" v-if="!shown.length">{{ empty }}</p>
    <p ref="end" class="vf-none" v-if="near.length < shown.length">{{ shown.length - near.length }} more below.</p>
  </div>`,
  props: { initial: Object, columns: Array },
  emits: ["sort"],
  data: () => ({ rows: new Map(), order: [], sort: "worst", reversed: false, tiled: false,
                 empty: "", live: true, drawn: STEP, clock: 0, at: performance.now(), tick: performance.now() }),
  created() { this.update(this.initial); },
  mounted() {
    this.timer = setInterval(() => { this.tick = performance.now(); }, 1000);
    this.eye = new IntersectionObserver(seen => { if (seen.some(one => one.isIntersecting)) this.drawn += STEP; },
      { rootMargin: "1000px" });
    this.look();
  },
  updated() { this.look(); },
  unmounted() { clearInterval(this.timer); this.eye.disconnect(); },
  computed: {
    near() { return this.shown.slice(0, this.drawn); },
    shown() { return this.order.map((i) => this.rows.get(i)).filter(Boolean); },
    lost() { return (this.tick - this.at) / 1000; },
    now() { return this.clock + Math.max(0, this.lost); },
  },
  methods: {
    age,
    look() {
      this.eye.disconnect();
      if (this.$refs.end) this.eye.observe(this.$refs.end);
    },
    update(news) {
      if (news.now) { this.clock = news.now; this.at = this.tick = performance.now(); }
      for (const row of Vue.toRaw(news).rows ?? []) this.rows.set(row.i, Object.freeze(row));
      if (news.order) this.order = news.order;
      for (const key of ["sort", "reversed", "tiled", "empty", "live"]) {
        if (news[key] !== undefined) this[key] = news[key];
      }
    },
    since(row) { return row.made ? age(this.now - row.made) : "–"; },
    heard(row) {
      if (!["silent", "unheard"].includes(row.state)) return this.lost > 4 ? age(this.lost) : "live";
      return row.last ? age(this.now - row.last) : "never";
    },
    open(event, row) {
      if (!event.target.closest("a") && !getSelection().toString()) location.href = row.href;
    },
    move(event) {
      const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
      if (!step) return;
      const links = [...this.$el.querySelectorAll("tbody a, .vf-tile")];
      const next = links[links.indexOf(document.activeElement) + step];
      if (next) { next.focus(); event.preventDefault(); }
    },
  },
};
