"use strict";

/* Report the height of the page, now and after each change, to the document in whose frame it is. */
if (window.parent !== window) {
  const report = () => {
    const height = document.documentElement.getBoundingClientRect().height;
    window.parent.postMessage({ sandboxHeight: height }, "*");
  };
  new ResizeObserver(report).observe(document.documentElement);
}
