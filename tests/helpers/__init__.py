"""What several tests share: packets, bodies, films and ports made for them."""
