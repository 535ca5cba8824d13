// Shows the end of the run if the page is loaded again after its server has stopped.
self.addEventListener("install", () => self.skipWaiting());
self.addEventListener("activate", (event) => event.waitUntil(self.clients.claim()));
self.addEventListener("fetch", (event) => {
  if (event.request.mode !== "navigate") return;
  event.respondWith(fetch(event.request).catch(async (fault) => {
    const end = await (await caches.open("snakewalk")).match("/end");
    if (end) return end;
    throw fault;
  }));
});
