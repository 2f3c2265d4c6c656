"""What electricity and the machine's time cost."""

from __future__ import annotations

from typing import Annotated, TypedDict

from fiveaxis.options.option import Option


class Costs(TypedDict, total=False):
    """Prices and emission, for the cost of a job."""

    price: Annotated[float | None, Option("price of 1 kWh, in the currency", least=0.0, flags="--kwh-price")]
    hour: Annotated[
        float | None, Option("rate of the machine per hour, in the currency", least=0.0, flags="--hour-rate")
    ]
    currency: Annotated[str, Option("currency of the prices", default="EUR")]
    co2: Annotated[float | None, Option("emission of the electricity", unit="kg of CO2 per kWh", least=0.0)]
