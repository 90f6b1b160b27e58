! my_law: linear elasticity and von Mises plasticity without hardening, for soft clay.
!
! (1) sigma* = sigma_0 + D d_eps                          elastic trial
! (2) q = sqrt(3/2 s:s) <= Y                              s: deviator of sigma
! (3) sigma = p 1 + Y/q* s*,  d_eps_p = (q* - Y)/(3 G)    radial return
!
! Components 11 22 33 12 [13 23], tension positive, shear strains gamma = 2 eps.
module law
  use pilum
  implicit none

  ! Numbers of the internal variables.
  integer, parameter :: PLASTIC_STRAIN = 1, N_STATES = 1

contains

  ! In the order in which `prepare` and `update` receive them.
  subroutine describe()
    call describe_law(id='my_law', name='von Mises plasticity', version='0.1.0', &
      author='unknown', licence='unknown', &
      doc='Linear elasticity and von Mises plasticity without hardening.', &
      references='none', prepare=prepare, update=update)
    call add_parameter('young_modulus', 'E', 'kPa', 'Young''s modulus.', &
      above=0.0_dp, usual=[1e2_dp, 1e9_dp])
    call add_parameter('poisson_ratio', 'nu', '-', 'Poisson''s ratio.', &
      above=-1.0_dp, below=0.5_dp, usual=[0.0_dp, 0.495_dp])
    call add_parameter('yield_stress', 'Y', 'kPa', &
      'Strength in uniaxial compression, twice the undrained shear strength.', &
      above=0.0_dp, usual=[1.0_dp, 1e6_dp])
    call add_state(PLASTIC_STRAIN, 'plastic_strain', 'eps_p', '-', 'Equivalent plastic strain.')
    call add_formulation(PILUM_H_PLANE_STRAIN, N_STATES, PILUM_T_SYMMETRIC)
    call add_formulation(PILUM_H_AXISYMMETRIC, N_STATES, PILUM_T_SYMMETRIC)
    call add_formulation(PILUM_H_3D, N_STATES, PILUM_T_SYMMETRIC)
  end subroutine

  ! Once: bulk and shear modulus instead of E and nu. A text in `refusal` refuses the parameters.
  subroutine prepare(p, refusal)
    real(dp), intent(inout) :: p(:)
    character(len=*), intent(inout) :: refusal
    real(dp) :: young, nu
    young = p(1)
    nu = p(2)
    p(1) = young/(3*(1 - 2*nu))
    p(2) = young/(2*(1 + nu))
  end subroutine

  ! One point over one increment. No allocation, no output, nothing remembered between calls.
  subroutine update(p, point, tangent, end, status)
    real(dp), intent(in) :: p(:)
    type(point_type), intent(in) :: point
    integer, intent(in) :: tangent
    type(response_type), intent(inout) :: end
    integer(c_int32_t), intent(inout) :: status
    real(dp) :: k, g, yield, bulk, mean, q, scale, shear, s(MAX_COMPONENTS)
    logical :: yields, plastic
    integer :: n, i, j
    k = p(1)
    g = p(2)
    yield = p(3)
    n = point%n
    status = PILUM_OK
    ! (1)
    bulk = (k - 2*g/3)*sum(point%increment(1:3))
    end%flux(1:3) = point%flux(1:3) + bulk + 2*g*point%increment(1:3)
    end%flux(4:n) = point%flux(4:n) + g*point%increment(4:n)
    mean = sum(end%flux(1:3))/3
    s(1:3) = end%flux(1:3) - mean
    s(4:n) = end%flux(4:n)
    q = sqrt(1.5_dp*(sum(s(1:3)**2) + 2*sum(s(4:n)**2)))
    ! (2), (3); what was returned before is within round-off.
    yields = q > yield*(1 + 1e-14_dp)
    scale = 1
    end%state(PLASTIC_STRAIN) = point%state(PLASTIC_STRAIN)
    if (yields) then
      scale = yield/q
      end%state(PLASTIC_STRAIN) = point%state(PLASTIC_STRAIN) + (q - yield)/(3*g)
      end%flux(1:3) = mean + scale*s(1:3)
      end%flux(4:n) = scale*s(4:n)
    end if
    if (tangent == TANGENT_NONE) return
    plastic = yields .and. tangent == TANGENT_CONSISTENT
    shear = g
    if (plastic) shear = scale*g
    end%tangent(1:3, 1:3) = k - 2*shear/3
    do i = 1, n
      end%tangent(i, i) = end%tangent(i, i) + merge(2*shear, shear, i <= 3)
    end do
    if (.not. plastic) return
    do j = 1, n
      do i = 1, n
        end%tangent(i, j) = end%tangent(i, j) - 3*shear*s(i)*s(j)/q**2
      end do
    end do
  end subroutine
end module

! What the host calls first.
function pilum_entry(host) result(library) bind(C, name='pilum_entry')
  use law
  implicit none
  type(c_ptr), value :: host
  type(c_ptr) :: library
  if (.not. described()) call describe()
  library = the_library()
end function
