/* Transport over the messages of a widget. Each view of it has a number, which replies repeat. */
export default {
  render({ model, el }) {
    const view = String(Math.random());
    const transport = { send: (inputs) => model.send({ view, inputs }), onmessage: null, onclose: null };
    const live = mount(el, transport);
    const receive = (message) => {
      if (message.view === view) transport.onmessage(message.reply);
    };
    model.on("msg:custom", receive);
    live.open();
    return () => {
      live.close();
      model.off("msg:custom", receive);
      model.send({ view, inputs: null });
    };
  },
};
