"""The live page: modules of pipelines, their data, and the site with report and documents."""
