// Shows the end of the run if the page is loaded again after its server has stopped, and the report.
self.addEventListener("install", () => self.skipWaiting());
self.addEventListener("activate", (event) => event.waitUntil(self.clients.claim()));
self.addEventListener("fetch", (event) => {
  if (event.request.mode !== "navigate") return;
  const kept = async (path) => (await caches.open("snakewalk")).match(path);
  const page = async () => {
    const path = new URL(event.request.url).pathname;
    const report = path === "/report" && await kept(path);
    return report || fetch(event.request).catch(async (fault) => {
      const end = await kept("/end");
      if (end) return end;
      throw fault;
    });
  };
  event.respondWith(page());
});
