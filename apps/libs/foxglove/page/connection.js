'use strict';
// A client of foxglove.sdk.v1 (github.com/foxglove/ws-protocol, docs/spec.md). It comes back when the server does.
class Connection {
  // on: {info, status, lost, message: topic, Cdr, time [ms]}; wants(topic): whether messages of it are wanted now.
  constructor(url, on, wants) {
    Object.assign(this, {url, on, wants});
    this.open();
  }
  open() {
    this.channels = new Map();  // id -> topic
    this.subscribed = new Set();
    this.published = null;
    const socket = this.socket = new WebSocket(this.url, ['foxglove.sdk.v1', 'foxglove.websocket.v1']);
    socket.binaryType = 'arraybuffer';
    socket.onmessage = ({data}) => typeof data === 'string' ? this.told(JSON.parse(data)) : this.got(new DataView(data));
    socket.onclose = () => {
      this.on.lost();
      setTimeout(() => this.open(), 1000);
    };
  }
  told(text) {
    if (text.op === 'serverInfo') this.on.info(text);
    if (text.op === 'status') this.on.status(text);
    if (text.op === 'advertise') {
      for (const one of text.channels) if (one.encoding === 'cdr') this.channels.set(one.id, one.topic);
      this.subscribe();
    }
  }
  got(view) {
    const topic = this.channels.get(view.getUint32(1, true));
    if (view.getUint8(0) !== 1 || topic === undefined) return;
    const time = Number(view.getBigUint64(5, true)) * 1e-6;
    this.on.message(topic, new Cdr(new DataView(view.buffer, 13)), time);
  }
  // Asks for what is wanted now, and for no more. A subscription has the number of its channel.
  subscribe() {
    const wanted = [], unwanted = [];
    for (const [id, topic] of this.channels) {
      const has = this.subscribed.has(id), wants = this.wants(topic);
      if (wants && !has) wanted.push(id);
      if (!wants && has) unwanted.push(id);
    }
    wanted.forEach(id => this.subscribed.add(id));
    unwanted.forEach(id => this.subscribed.delete(id));
    if (wanted.length) this.send({op: 'subscribe', subscriptions: wanted.map(id => ({id, channelId: id}))});
    if (unwanted.length) this.send({op: 'unsubscribe', subscriptionIds: unwanted});
  }
  send(text) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(text));
  }
  publish(topic, schemaName, message) {
    if (this.published !== topic) this.send({op: 'advertise', channels: [{id: 1, topic, encoding: 'json', schemaName}]});
    this.published = topic;
    this.socket.send(new Blob([new Uint8Array([1, 1, 0, 0, 0]), JSON.stringify(message)]));
  }
}
