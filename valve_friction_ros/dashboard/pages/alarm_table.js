// A list of alarms, or of their events. All text goes into text nodes and attributes by Vue's
// bindings, never into markup. Only rows near the view are drawn: more come as it is scrolled.
const STEP = 60;
export default {
  template: `
  <div class="vf-alarms">
    <table v-if="rows.length" class="vf-list vf-alarm-list">
      <thead><tr>
        <th scope="col">{{ journal ? "Time" : "Since" }}</th><th scope="col">Valve</th>
        <th scope="col">Alarm</th><th scope="col">State</th><th scope="col">What to do</th>
        <th scope="col">{{ journal ? "Event" : "Last event" }}</th>
        <th scope="col" v-if="!journal && may">Action</th>
      </tr></thead>
      <tbody>
        <tr v-for="row in near" :key="row.i" v-memo="[row]">
          <td class="vf-when">{{ journal ? row.when : row.raised }}</td>
          <td><a class="vf-link" :href="row.href">{{ row.tag }}</a><small class="vf-about">{{ row.area }}</small></td>
          <td><span class="vf-chip" :class="'vf-' + row.css">{{ row.kind }}</span>
            <small class="vf-about">{{ row.level }}</small></td>
          <td>{{ row.state }}<small class="vf-about" v-if="row.until">until {{ row.until }}</small></td>
          <td class="vf-words"><b v-if="row.advice">{{ row.advice }}</b><small class="vf-about">{{ row.say }}</small></td>
          <td class="vf-words">{{ row.by }}<small class="vf-about" v-if="row.text">{{ row.text }}</small>
            <small class="vf-about" v-if="!journal">{{ row.when }}</small></td>
          <td v-if="!journal && may" class="vf-row-acts">
            <button v-if="row.can.includes('ACKNOWLEDGE')" type="button" class="vf-filter"
              :aria-label="'Acknowledge ' + row.kind + ' of ' + row.tag"
              @click="$emit('ask', [row.alarm, 'ACKNOWLEDGE'])">Acknowledge</button>
            <button type="button" class="vf-filter" :aria-label="'More for ' + row.kind + ' of ' + row.tag"
              @click="$emit('ask', [row.alarm, ''])">More …</button></td>
        </tr>
      </tbody>
    </table>
    <p ref="end" class="vf-none" v-if="near.length < rows.length">{{ rows.length - near.length }} more below.</p>
    <p class="vf-empty" v-if="!rows.length">{{ empty }}</p>
  </div>`,
  props: { initial: Object, may: Boolean },
  emits: ["ask"],
  data: () => ({ rows: [], journal: false, empty: "", drawn: STEP }),
  computed: { near() { return this.rows.slice(0, this.drawn); } },
  created() { this.update(this.initial); },
  mounted() {
    this.eye = new IntersectionObserver(seen => { if (seen.some(one => one.isIntersecting)) this.drawn += STEP; },
      { rootMargin: "1000px" });
    this.look();
  },
  updated() { this.look(); },
  unmounted() { this.eye.disconnect(); },
  methods: {
    look() {
      this.eye.disconnect();
      if (this.$refs.end) this.eye.observe(this.$refs.end);
    },
    update(news) {
      this.rows = Vue.toRaw(news).rows.map(Object.freeze);
      this.journal = news.journal;
      this.empty = news.empty;
    },
  },
};
