!> The version of the package; a test compares it with the version in fpm.toml.
module frb_release
    implicit none
    private

    public :: version

    character(*), parameter :: version = '0.2.0'

end module frb_release
