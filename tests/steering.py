"""An order to a run that goes on, as the page of its viewer sends it."""

import json
import urllib.parse
import urllib.request


def steer(address: str, **order: object) -> None:
    """`address`: the page's. HTTPError when it is refused."""
    place = urllib.parse.urlsplit(address)
    headers = {"Origin": f"http://{place.netloc}", "Content-Type": "application/json"}
    body = json.dumps(order).encode()
    request = urllib.request.Request(f"{address}steer", body, headers, method="POST")
    urllib.request.urlopen(request, timeout=600).close()
